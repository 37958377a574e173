//! Under way: the room `embree`.
