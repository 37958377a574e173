//! Under way: the manifest of a sequence.
