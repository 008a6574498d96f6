# gib: build, show, test, install. `make` builds; `make help` lists the rest.
#
# Set on the command line as usual: PREFIX, DESTDIR, LIBDIR, INCLUDEDIR, BINDIR, CC, CARGO.

CARGO ?= cargo
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
BINDIR ?= $(PREFIX)/bin
DOCDIR ?= $(PREFIX)/share/doc/gib
INSTALL ?= install

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
TARGET := $(or $(CARGO_TARGET_DIR),target)
# PROFILE=quick builds sooner and runs slower: for work on the C programs, never for counts or an install.
PROFILE ?= release
RELEASE := $(TARGET)/$(PROFILE)
# What a C program outside the tree would find installed: the libraries with their links.
LIB := build/lib

.PHONY: all build header demo test deps check-format check-lints rust-tests test-on-all-cores test-rust test-parquet test-harness linuxcnc-test bench scoreboard install uninstall clean help

all: build

build: $(LIB)/libgib.a ## the libraries (build/lib) and the command (target/release/gib)

# Remade when a source changed, so that `sudo make install` after `make` needs no cargo.
$(LIB)/libgib.a: Cargo.toml Cargo.lock build.rs tools/static-archive $(shell find src -name '*.rs')
	$(CARGO) build --profile $(PROFILE)
	@mkdir -p $(LIB)
	@objcopy --strip-debug $(RELEASE)/libgib.so $(LIB)/libgib.so.$(VERSION)
	@ln -sf libgib.so.$(VERSION) $(LIB)/libgib.so.0
	@ln -sf libgib.so.0 $(LIB)/libgib.so
	@tools/static-archive $(RELEASE)/libgib.a $(RELEASE)/libgib.so $@

header: ## write include/gib.h from the Rust sources
	GIB_BLESS=1 $(CARGO) test -q --test header committed_header_is_fresh

demo: build ## show what gib does
	@test ! -e c-harness/Makefile || $(MAKE) -s -C c-harness all
	@GIB=$(RELEASE)/gib tools/demo

# What links comes first; other packages come while the compiler is at work, and what cargo has built for the tests is what
# is then shipped.
test: check-format ## everything that must hold
	@command -v cc >/dev/null || $(MAKE) -s deps
	@$(MAKE) -s -j3 deps rust-tests check-lints
	@$(MAKE) -s build
	@$(MAKE) -s -j3 test-on-all-cores linuxcnc-test
	@echo "make test: all passed"

# The control runs in real time and takes a tenth of a core: the others, two at a time, go on beside it and give way to it.
test-on-all-cores:
	@nice $(MAKE) -s test-rust
	@nice $(MAKE) -s test-harness

deps: ## install the Debian packages that the tests need
	@tools/deps

check-format:
	@if $(CARGO) fmt --version >/dev/null 2>&1; then $(CARGO) fmt --check; else echo "check-format: skipped, no rustfmt"; fi

# A warning fails the test for the version that these sources are kept clean with; a newer one knows new lints, and a
# stranger's test should not fail for them.
CLIPPY := $(shell $(CARGO) clippy --version 2>/dev/null)
check-lints:
	@if [ -n "$(CLIPPY)" ]; then $(CARGO) clippy -q --all-targets $(if $(findstring clippy 0.1.95,$(CLIPPY)),-- -D warnings); \
	else echo "check-lints: skipped, no clippy"; fi

rust-tests:
	$(CARGO) test --profile $(PROFILE) --no-run

# Cargo does not take part in the jobs of make, and rustdoc would warn of them.
test-rust:
	GIB_RELEASE=$(RELEASE) MAKEFLAGS= $(CARGO) test --profile $(PROFILE)

test-parquet: ## the feature parquet, which takes minutes to build and is not in `make test`
	$(CARGO) test --features parquet --lib -- parquet

test-harness:
	@if [ -e c-harness/Makefile ]; then $(MAKE) -C c-harness test; else echo "test-harness: skipped, no c-harness/Makefile"; fi

linuxcnc-test: build ## a simulated mill in the real control, headless; skipped where LinuxCNC is not installed
	@if ! command -v linuxcnc >/dev/null || ! command -v halcompile >/dev/null; then \
	    echo "linuxcnc-test: skipped, no linuxcnc or halcompile (Debian: linuxcnc-uspace, linuxcnc-uspace-dev)"; \
	else $(MAKE) -s -C linuxcnc test; fi

bench: build ## instructions per step, printed
	@if [ -e c-harness/Makefile ]; then $(MAKE) -C c-harness bench; else echo "bench: skipped, no c-harness/Makefile"; fi

# 64 cases take some five minutes on two busy cores; CASES= and SEED= (the clock where left out) for others.
scoreboard: build ## hide effects in random machines and score what gib diagnose says
	$(CARGO) build --profile $(PROFILE) --example scoreboard
	$(RELEASE)/examples/scoreboard --gib $(RELEASE)/gib --longest 40 --cases $(or $(CASES),64) $(if $(SEED),--seed $(SEED)) $(if $(CAUSE),--cause $(CAUSE))

install: build ## into $(DESTDIR)$(PREFIX)
	$(INSTALL) -d $(addprefix $(DESTDIR),$(INCLUDEDIR) $(LIBDIR)/pkgconfig $(BINDIR) $(DOCDIR))
	$(INSTALL) -m 644 include/gib.h $(DESTDIR)$(INCLUDEDIR)/gib.h
	$(INSTALL) -m 755 $(LIB)/libgib.so.$(VERSION) $(DESTDIR)$(LIBDIR)/libgib.so.$(VERSION)
	ln -sf libgib.so.$(VERSION) $(DESTDIR)$(LIBDIR)/libgib.so.0
	ln -sf libgib.so.0 $(DESTDIR)$(LIBDIR)/libgib.so
	$(INSTALL) -m 644 $(LIB)/libgib.a $(DESTDIR)$(LIBDIR)/libgib.a
	sed -e 's|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|; s|@INCLUDEDIR@|$(INCLUDEDIR)|; s|@VERSION@|$(VERSION)|' \
	    tools/gib.pc.in > $(DESTDIR)$(LIBDIR)/pkgconfig/gib.pc
	$(INSTALL) -m 755 $(RELEASE)/gib $(DESTDIR)$(BINDIR)/gib
	@for file in $(DOCS); do $(INSTALL) -D -m 644 $$file $(DESTDIR)$(DOCDIR)/$$file; done
	@test -n "$(DESTDIR)" || ldconfig 2>/dev/null || true

# With their folders, so that the links of the README hold.
DOCS := $(wildcard README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE docs/*.md docs/*.svg c-harness/kernel.h c-harness/plant.h)

uninstall: ## remove exactly what install wrote
	rm -f $(DESTDIR)$(INCLUDEDIR)/gib.h $(DESTDIR)$(LIBDIR)/pkgconfig/gib.pc $(DESTDIR)$(BINDIR)/gib
	rm -f $(addprefix $(DESTDIR)$(LIBDIR)/,libgib.so.$(VERSION) libgib.so.0 libgib.so libgib.a)
	rm -f $(addprefix $(DESTDIR)$(DOCDIR)/,$(DOCS))
	@for folder in $(addprefix $(DESTDIR)$(DOCDIR),/docs /c-harness ""); do \
	    test ! -d $$folder || rmdir --ignore-fail-on-non-empty $$folder; done
	@test -n "$(DESTDIR)" || ldconfig 2>/dev/null || true

clean: ## remove everything that make builds
	$(CARGO) clean
	rm -rf build
	@test ! -e c-harness/Makefile || $(MAKE) -s -C c-harness clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' $(MAKEFILE_LIST) | column -t -s '|'
