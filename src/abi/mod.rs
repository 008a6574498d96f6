//! The C surface: guard, types, one file a family; nothing but translation. The only room with `unsafe`.

pub mod guard;
