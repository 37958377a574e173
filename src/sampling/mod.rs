//! Under way: the room `sampling`.
