//! Under way: the room `sequence`.
