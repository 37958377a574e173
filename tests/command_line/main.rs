//! The program as a user meets it: words, exit codes, files.

mod comparing;
mod interrupted;
mod job;
mod killed;
mod pages;
mod ranks;
mod references;
mod rendering;
mod resumed;
mod reuse;
mod verify;
mod words;
