//! The program as a user meets it: words, exit codes, files.

mod choosing;
mod comparing;
mod interrupted;
mod job;
mod pages;
mod ranks;
mod references;
mod rendering;
mod reuse;
mod verify;
mod words;
