//! Under way: the room `cluster`.
