//! What standard input may ask for.

use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Deserialize;
use serde_json::value::RawValue;

use crate::Failure;
use crate::dds::{Peer, Publish};
use crate::messages::Time;

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Command {
    Write(OnTopic),
    Play(Play),
}

#[derive(Deserialize)]
pub struct OnTopic {
    pub topic: String,
    pub message: Box<RawValue>,
}

#[derive(Deserialize)]
pub struct Play {
    frames: Vec<Vec<OnTopic>>,
    /// Frames a second.
    rate: f64,
    count: usize,
}

impl Play {
    /// Publish, and say how many frames there were.
    pub fn run(&self, peer: &Peer) -> Result<usize, Failure> {
        let prepare = |one: &OnTopic| peer.writer(&one.topic)?.prepared(&one.message);
        let prepared = self
            .frames
            .iter()
            .map(|frame| frame.iter().map(prepare).collect::<Result<Vec<_>, _>>())
            .collect::<Result<Vec<_>, _>>()?;
        let begun = Instant::now();
        for (number, frame) in prepared.iter().cycle().take(self.count).enumerate() {
            let due = begun + Duration::from_secs_f64(number as f64 / self.rate);
            sleep(due.saturating_duration_since(Instant::now()));
            let copies: Vec<Box<dyn Publish>> = frame.iter().map(|one| one.copied()).collect();
            let stamp = now()?;
            for message in copies {
                message.publish(Some(stamp))?;
            }
        }
        Ok(self.count)
    }
}

/// The time as ROS has it.
fn now() -> Result<Time, Failure> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH)?;
    Ok(Time {
        sec: i32::try_from(since.as_secs())?,
        nanosec: since.subsec_nanos(),
    })
}
