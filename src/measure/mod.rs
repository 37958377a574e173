//! Under way: the room `measure`.
