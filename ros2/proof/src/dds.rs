//! Readers and writers of topics, whatever their type.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread;
use std::time::{SystemTime, UNIX_EPOCH};

use futures::StreamExt;
use futures::executor::block_on;
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile,
};
use rustdds::DomainParticipantBuilder;
use serde::Serialize;
use serde_json::json;
use serde_json::value::RawValue;

use crate::messages::{Message, Time, with_type};
use crate::{Failure, say};

/// A topic, its type and its quality of service.
pub struct Endpoint {
    topic: String,
    kind: String,
    profile: QosProfile,
}

impl Endpoint {
    pub fn from_arguments(arguments: &mut impl Iterator<Item = String>) -> Result<Self, Failure> {
        let mut next = || arguments.next().ok_or("an endpoint is TOPIC TYPE PROFILE");
        Ok(Self {
            topic: next()?,
            kind: next()?,
            profile: profile(&next()?)?,
        })
    }
}

/// As ROS 2 has them by default, and planegrasp in `profiles.py`.
fn profile(name: &str) -> Result<QosProfile, Failure> {
    let kept = |depth| {
        QosProfile::publisher_default()
            .reliability_reliable(WhenFull::DEFAULT)
            .history(History::KeepLast { depth })
    };
    match name {
        "default" => Ok(kept(10)),
        "tf" => Ok(kept(100)),
        "kept" => Ok(kept(10).durability(Durability::TransientLocal)),
        "sensor" => Ok(kept(5).reliability_best_effort()),
        _ => Err(format!("no profile {name:?}: default, sensor, tf, kept").into()),
    }
}

/// A node in a domain, on the loopback interface.
pub struct Peer {
    node: Node,
    writers: HashMap<String, Box<dyn Prepare>>,
}

impl Peer {
    pub fn new(domain: u16) -> Result<Self, Failure> {
        let participant = DomainParticipantBuilder::new(domain)
            .with_only_networks([[127, 0, 0, 1]])
            .build()?;
        let context = Context::from_domain_participant(participant)?;
        let name = NodeName::new("/proof", "peer").map_err(|error| error.to_string())?;
        let options = NodeOptions::new().enable_rosout(false);
        Ok(Self {
            node: context.new_node(name, options)?,
            writers: HashMap::new(),
        })
    }

    /// Print what comes on a topic.
    pub fn read(&mut self, endpoint: &Endpoint, is_brief: bool) -> Result<(), Failure> {
        with_type!(endpoint.kind.as_str(), M => self.read_as::<M>(endpoint, is_brief))
    }

    /// Announce that a topic will be written.
    pub fn write(&mut self, endpoint: &Endpoint) -> Result<(), Failure> {
        with_type!(endpoint.kind.as_str(), M => self.write_as::<M>(endpoint))
    }

    pub fn writer(&self, topic: &str) -> Result<&dyn Prepare, Failure> {
        match self.writers.get(topic) {
            Some(writer) => Ok(writer.as_ref()),
            None => Err(format!("{topic} was not announced by --write").into()),
        }
    }

    fn topic(&self, endpoint: &Endpoint) -> Result<rustdds::Topic, Failure> {
        let (package, name) = endpoint
            .kind
            .split_once("/msg/")
            .ok_or("a type is PACKAGE/msg/NAME")?;
        let topic = Name::parse(&endpoint.topic).map_err(|error| error.to_string())?;
        let kind = MessageTypeName::new(package, name);
        Ok(self.node.create_topic(&topic, kind, &endpoint.profile)?)
    }

    fn read_as<M: Message>(&mut self, endpoint: &Endpoint, is_brief: bool) -> Result<(), Failure> {
        let topic = self.topic(endpoint)?;
        let subscription = self.node.create_subscription::<M>(&topic, None)?;
        let name = endpoint.topic.clone();
        thread::spawn(move || {
            block_on(subscription.async_stream().for_each(|result| {
                let at = since_1970();
                match result {
                    Ok((message, _)) if is_brief => {
                        say(&json!({"topic": name, "at": at, "stamp": message.stamp()}));
                    }
                    Ok((message, _)) => say(&Received {
                        topic: &name,
                        at,
                        message: &message,
                    }),
                    Err(error) => say(&json!({"topic": name, "error": error.to_string()})),
                }
                futures::future::ready(())
            }));
        });
        Ok(())
    }

    fn write_as<M: Message>(&mut self, endpoint: &Endpoint) -> Result<(), Failure> {
        let topic = self.topic(endpoint)?;
        let publisher = Arc::new(self.node.create_publisher::<M>(&topic, None)?);
        self.writers
            .insert(endpoint.topic.clone(), Box::new(Writer { publisher }));
        Ok(())
    }
}

#[derive(Serialize)]
struct Received<'a, M> {
    topic: &'a str,
    at: u64,
    message: &'a M,
}

/// Makes messages of JSON.
pub trait Prepare {
    fn prepared(&self, json: &RawValue) -> Result<Box<dyn Publish>, Failure>;
}

/// A message that waits to be published.
pub trait Publish {
    fn copied(&self) -> Box<dyn Publish>;

    /// Publish it, with another stamp where one is given.
    fn publish(self: Box<Self>, stamp: Option<Time>) -> Result<(), Failure>;
}

struct Writer<M: Message> {
    publisher: Arc<Publisher<M>>,
}

impl<M: Message> Prepare for Writer<M> {
    fn prepared(&self, json: &RawValue) -> Result<Box<dyn Publish>, Failure> {
        let message: M = serde_json::from_str(json.get())?;
        Ok(Box::new(Ready {
            publisher: Arc::clone(&self.publisher),
            message,
        }))
    }
}

struct Ready<M: Message> {
    publisher: Arc<Publisher<M>>,
    message: M,
}

impl<M: Message> Publish for Ready<M> {
    fn copied(&self) -> Box<dyn Publish> {
        Box::new(Self {
            publisher: Arc::clone(&self.publisher),
            message: self.message.clone(),
        })
    }

    fn publish(mut self: Box<Self>, stamp: Option<Time>) -> Result<(), Failure> {
        if let Some(stamp) = stamp {
            self.message.set_stamp(stamp);
        }
        let Self { publisher, message } = *self;
        publisher
            .publish(message)
            .map_err(|error| error.to_string().into())
    }
}

fn since_1970() -> u64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
