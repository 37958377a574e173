//! Under way: the room `cli`.
