//! A participant of ROS 2 on the DDS of other people (RustDDS by `ros2-client`), driven by lines of JSON.
//!
//! `ros2-peer DOMAIN [--brief] [--read TOPIC TYPE PROFILE]… [--write TOPIC TYPE PROFILE]…` says
//! `{"ready": true}`, then one line for each message that comes:
//! `{"topic": …, "at": nanoseconds since 1970, "message": {…}}`, with `--brief` its `stamp` in the place of
//! the message. PROFILE is one of default, sensor, tf and kept. Standard input takes
//!
//! * `{"write": {"topic": …, "message": {…}}}`: publish it as it is;
//! * `{"play": {"frames": [[{"topic": …, "message": {…}}, …], …], "rate": 30.0, "count": 300}}`: publish
//!   these groups in turn, so many in all, each with the time of its sending as its stamp; `{"played": n}`
//!   says that it is done.
//!
//! Bytes are base64 in JSON. It ends with its standard input.

mod commands;
mod dds;
mod messages;
mod raw;

use std::io::{BufRead, Write};
use std::process::ExitCode;

use crate::commands::Command;
use crate::dds::{Endpoint, Peer};

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ros2-peer: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let domain = arguments.next().ok_or("which domain?")?.parse()?;
    // What comes while there are still endpoints to make is said after that it is ready.
    let mut out = std::io::stdout().lock();
    let mut peer = Peer::new(domain)?;
    let mut is_brief = false;
    while let Some(option) = arguments.next() {
        match option.as_str() {
            "--brief" => is_brief = true,
            "--read" => peer.read(&Endpoint::from_arguments(&mut arguments)?, is_brief)?,
            "--write" => peer.write(&Endpoint::from_arguments(&mut arguments)?)?,
            other => return Err(format!("{other:?} is no option").into()),
        }
    }
    writeln!(out, "{}", serde_json::json!({"ready": true}))?;
    out.flush()?;
    drop(out);
    for line in std::io::stdin().lock().lines() {
        match serde_json::from_str(&line?)? {
            Command::Write(one) => peer
                .writer(&one.topic)?
                .prepared(&one.message)?
                .publish(None)?,
            Command::Play(play) => {
                let count = play.run(&peer)?;
                say(&serde_json::json!({"played": count}));
            }
        }
    }
    Ok(())
}

/// Print a line at once.
fn say(line: &impl serde::Serialize) {
    let mut out = std::io::stdout().lock();
    let text =
        serde_json::to_string(line).unwrap_or_else(|error| format!("{{\"error\": \"{error}\"}}"));
    // Who listened is gone: standard input ends, too.
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}
