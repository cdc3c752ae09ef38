//! What most tests use: a folder with an FMU, files, processes and times.

pub(crate) use crate::bench::{
    Bench, FMI3, LOOP, PATIENCE, Recipe, assert_has, await_until, await_while_it_runs, plain,
    with_usual_signals,
};
pub(crate) use crate::campaign::{CAMPAIGN, RANDOM};
pub(crate) use std::fs;
pub(crate) use std::io::{Read, Write};
pub(crate) use std::path::Path;
pub(crate) use std::process::{Command, Stdio};
pub(crate) use std::time::{Duration, Instant};
pub(crate) use zip::write::SimpleFileOptions;
