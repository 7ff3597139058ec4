//! What is one thing on the wire and another in JSON.

use std::fmt;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A sequence of bytes: in one piece on the wire, base64 in JSON.
#[derive(Clone, Debug, Default)]
pub struct Bytes(pub Vec<u8>);

impl Serialize for Bytes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.serialize_str(&STANDARD.encode(&self.0))
        } else {
            serializer.serialize_bytes(&self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Bytes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            let text = String::deserialize(deserializer)?;
            STANDARD.decode(text).map(Bytes).map_err(D::Error::custom)
        } else {
            deserializer.deserialize_byte_buf(Owned).map(Bytes)
        }
    }
}

struct Owned;

impl Visitor<'_> for Owned {
    type Value = Vec<u8>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("bytes")
    }

    fn visit_byte_buf<E>(self, bytes: Vec<u8>) -> Result<Vec<u8>, E> {
        Ok(bytes)
    }
}

/// 36 numbers, also in JSON: serde has no arrays of more than 32, but rows are the same on the wire.
#[derive(Clone, Debug)]
pub struct Covariance([[f64; 6]; 6]);

impl Serialize for Covariance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            self.0.as_flattened().serialize(serializer)
        } else {
            self.0.serialize(serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Covariance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            return <[[f64; 6]; 6]>::deserialize(deserializer).map(Covariance);
        }
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        let (rows, rest) = numbers.as_chunks::<6>();
        match <[[f64; 6]; 6]>::try_from(rows) {
            Ok(rows) if rest.is_empty() => Ok(Covariance(rows)),
            _ => Err(D::Error::invalid_length(numbers.len(), &"36 numbers")),
        }
    }
}
