/*
 * gib.h - the layer between an NC kernel and the metal.
 *
 * Generated from the Rust sources by `make header`; do not edit. MIT OR Apache-2.0.
 *
 * FAMILIES AND THEIR LIFE
 *   Each function of the machine is one family: gib_backlash_..., and so on. An axis or a spindle is one instance.
 *   Two instances share nothing; there is no global state.
 *
 *     memory     gib_<family>_new / _free, or _size and _init_in for memory of your own
 *     _start     setup: takes the configuration; the rising edge of PLCopen's Execute
 *     _step      once per servo cycle: measured values in, commands out; returns GIB_BUSY until it returns
 *                GIB_DONE or an error. Done, aborted and error exclude one another
 *     _result    reads what was found
 *     _abort     ends at the next step, by the door that restores whatever was changed
 *     _last_error  code, field, value and bounds of the first error, which is kept until the next start
 *
 * STATUS
 *   int32_t: GIB_OK is 0, progress is positive, an error is negative. Numbers never change.
 *   gib_status_text explains each. Enums cross as int32_t and are range-checked.
 *
 * UNITS
 *   The unit is in the name: _mm _um _mm_s _nm _nm_mm _rpm _s _cycles _deg _ratio. One unit a quantity.
 *   Time is counted in servo cycles; gib reads no clock.
 *
 * MEMORY
 *   Memory of your own is as large as _size says, aligned to 16 bytes, and may be moved between calls with memcpy:
 *   a state holds no pointer into itself. Whatever you pass in stays yours and is not kept after the call.
 *   Texts that gib returns are static: never free them.
 *
 * GROWTH
 *   A configuration starts with uint32_t struct_size: set it to sizeof. Zero the rest first; zero in a field that
 *   was added later means the old behaviour. Structs that cross in every cycle are frozen within an ABI major.
 *
 * THREADS
 *   Each comment ends in tags: [thread: setup|cycle|any] [real-time: yes|no] [state: ...].
 *   One instance is used by one thread at a time; different instances may be used by different threads.
 *
 * REAL TIME
 *   A function tagged [real-time: yes] allocates nothing, locks nothing, makes no system call, has no unbounded
 *   loop and cannot panic. In the others a panic ends at the boundary and is returned as GIB_ERR_INTERNAL.
 *
 * SAFE OUTPUTS
 *   Given a valid output pointer, a step always writes a safe command, also when it returns an error. NaN or
 *   infinity in is an error and never NaN out. NULL is always checked.
 *
 * WRITES THAT THE KERNEL PERFORMS
 *   gib never writes a parameter of the NC. A step's output asks for it; the next input acknowledges it. What is
 *   not acknowledged in time is asked back, and the function ends with an error.
 *
 * LOADING
 *   Link with `pkg-config --cflags --libs gib`, or dlopen "libgib.so.0" and look up "gib_api" alone.
 */

#ifndef GIB_H
#define GIB_H

#include <stddef.h>
#include <stdint.h>

/**
 * The call did what it says; nothing more is to be expected from it.
 */
#define GIB_OK 0

/**
 * The function is running: call its `_step` again in the next servo cycle.
 */
#define GIB_BUSY 1

/**
 * The function has ended well and its result can be read.
 */
#define GIB_DONE 2

/**
 * A required pointer is NULL.
 */
#define GIB_ERR_NULL (-1)

/**
 * The memory behind the handle was never initialised, or was freed.
 */
#define GIB_ERR_HANDLE (-2)

/**
 * A configuration value is out of range; `_last_error` names the field, the value and the bound.
 */
#define GIB_ERR_CONFIG (-3)

/**
 * `struct_size` is shorter than the first published size, or an unknown tail is not zero.
 */
#define GIB_ERR_STRUCT_SIZE (-4)

/**
 * The call is not legal in the present state (see the function's `[state: …]`).
 */
#define GIB_ERR_STATE (-5)

/**
 * The caller aborted; everything changed has been restored.
 */
#define GIB_ERR_ABORTED (-6)

/**
 * An internal fault was caught at the boundary. Please report it.
 */
#define GIB_ERR_INTERNAL (-7)

/**
 * Memory could not be had, or the memory given is too small or misaligned.
 */
#define GIB_ERR_MEMORY (-8)

/**
 * The caller's buffer is too small; the needed size has been written.
 */
#define GIB_ERR_BUFFER (-9)

/**
 * An input of this cycle is NaN or infinite.
 */
#define GIB_ERR_NON_FINITE (-10)

/**
 * The kernel reported a drive fault.
 */
#define GIB_ERR_DRIVE_FAULT (-11)

/**
 * A parameter write was not acknowledged in time; the old values were requested again.
 */
#define GIB_ERR_ACK_TIMEOUT (-12)

/**
 * The torque bound of the configuration was exceeded.
 */
#define GIB_ERR_TORQUE_BOUND (-13)

/**
 * The travel bound of the configuration was exceeded.
 */
#define GIB_ERR_TRAVEL_BOUND (-14)

/**
 * A state did not end before its deadline.
 */
#define GIB_ERR_DEADLINE (-15)

/**
 * The restore of the old values was not acknowledged: the machine may run with changed parameters.
 */
#define GIB_ERR_RESTORE_UNCONFIRMED (-16)

/**
 * The function is switched off.
 */
#define GIB_ERR_DISABLED (-17)

/**
 * A file could not be read or written.
 */
#define GIB_ERR_IO (-18)

/**
 * A file or text does not have the format it should have.
 */
#define GIB_ERR_FORMAT (-19)

/**
 * This library cannot serve the ABI version asked for.
 */
#define GIB_ERR_VERSION (-20)

/**
 * The torque never rose after the reversal: no end of the lost motion was seen.
 */
#define GIB_ERR_BACKLASH_NO_RISE (-100)

/**
 * The table had not broken away when the detection limit was reached.
 */
#define GIB_ERR_BACKLASH_LIMIT (-101)

/**
 * The stiffness line is lost in the torque noise: the value would mean nothing.
 */
#define GIB_ERR_BACKLASH_NOISE (-102)

/**
 * The two directions disagree by more than their uncertainties allow.
 */
#define GIB_ERR_BACKLASH_DIRECTIONS (-103)

/**
 * The lost motion is smaller than the encoder or the noise can resolve.
 */
#define GIB_ERR_BACKLASH_RESOLUTION (-104)

/**
 * The torque curve has not the shape of a release, a clearance and a wind-up.
 */
#define GIB_ERR_BACKLASH_SHAPE (-105)

/**
 * The share of friction on the motor side could not be told from the wind-up.
 */
#define GIB_ERR_BACKLASH_MOTOR_FRICTION (-106)

/**
 * Version of this interface: major · 65536 + minor.
 *
 * Within one major, functions, struct tails and status numbers are added and nothing is changed or taken away;
 * each addition raises the minor. The major is also the number at the end of `libgib.so.0`.
 */
#define GIB_ABI_VERSION 1

/**
 * All functions of the library, each named as in this header without its `gib_`.
 *
 * Get it from `gib_api`. A member whose offset is not below `struct_size` is not in this library.
 */
typedef struct gib_api_table {
    /**
     * Size of the table that this library has, in bytes.
     */
    uint32_t struct_size;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * See gib_abi_version.
     */
    uint32_t (*abi_version)(void);
    /**
     * See gib_version.
     */
    const char *(*version)(void);
    /**
     * See gib_status_text.
     */
    const char *(*status_text)(int32_t status);
} gib_api_table;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Version of the interface that the loaded library serves; compare it with `GIB_ABI_VERSION` of the header.
 *
 * @return major · 65536 + minor. The library fits when the majors are equal and its minor is not below the header's.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uint32_t gib_abi_version(void);

/**
 * Version of the library as text, for a log or an about box.
 *
 * @return static text such as "0.1.0", NUL-terminated; never NULL, never freed.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const char *gib_version(void);

/**
 * The sentence that explains a status.
 *
 * @param status any value that a gib function returned.
 * @return static text, NUL-terminated; never NULL, never freed; for an unknown number a text that says so.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const char *gib_status_text(int32_t status);

/**
 * The table of all functions, so that `dlsym` needs one name: "gib_api".
 *
 * @param version pass `GIB_ABI_VERSION`.
 * @return a table that lives as long as the library is loaded and is never freed; NULL when this library cannot serve
 * that version, because its major differs or its minor is older.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const struct gib_api_table *gib_api(uint32_t version);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GIB_H */
