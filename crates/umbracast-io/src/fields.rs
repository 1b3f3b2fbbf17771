//! A message described once: one visit of its fields gives its ROS 2 definition, its CDR, and the reader.

use crate::cdr::{Decoder, Encoder};
use crate::messages::{HEADER_DEFINITIONS, Schema};
use umbracast::geometry::{DMat3, DVec2, DVec3};

/// A message, or a part of one.
pub trait Message: Sized {
    /// Its name in the package `umbracast_msgs`.
    const NAME: &'static str;
    /// What it is, in a sentence.
    const WHAT: &'static str;

    /// One without content: what is read is read into it.
    fn empty() -> Self;

    /// Shows every field, in the order of the message.
    fn visit(&mut self, fields: &mut impl Fields);
}

/// Who sees the fields of a message.
pub trait Fields: Sized {
    /// `std_msgs/Header`, always in the frame `site`; the first field of a message that is sent.
    fn header(&mut self, time_ns: &mut i64);
    /// `bool`
    fn bool(&mut self, name: &str, value: &mut bool);
    /// `uint32`
    fn u32(&mut self, name: &str, value: &mut u32);
    /// `uint64`
    fn u64(&mut self, name: &str, value: &mut u64);
    /// `int64`
    fn i64(&mut self, name: &str, value: &mut i64);
    /// `float64`
    fn f64(&mut self, name: &str, value: &mut f64);
    /// `string`
    fn string(&mut self, name: &str, value: &mut String);
    /// `float64[N]`
    fn f64_array(&mut self, name: &str, values: &mut [f64]);
    /// `uint32[N]`
    fn u32_array(&mut self, name: &str, values: &mut [u32]);
    /// `float64[]`
    fn f64_list(&mut self, name: &str, values: &mut Vec<f64>);
    /// `uint32[]`
    fn u32_list(&mut self, name: &str, values: &mut Vec<u32>);
    /// `string[]`
    fn strings(&mut self, name: &str, values: &mut Vec<String>);
    /// `uint8[]`
    fn bytes(&mut self, name: &str, value: &mut Vec<u8>);
    /// A message within.
    fn one<M: Message>(&mut self, name: &str, value: &mut M);
    /// Any number of them.
    fn list<M: Message>(&mut self, name: &str, values: &mut Vec<M>);
}

/// A number of a sensor, an access point or the like.
pub(crate) fn index(f: &mut impl Fields, name: &str, value: &mut usize) {
    let mut number = *value as u32;
    f.u32(name, &mut number);
    *value = number as usize;
}

/// Metres, or metres a second.
pub(crate) fn vec2(f: &mut impl Fields, name: &str, value: &mut DVec2) {
    f.f64_array(name, AsMut::<[f64; 2]>::as_mut(value));
}

/// The same with a height.
pub(crate) fn vec3(f: &mut impl Fields, name: &str, value: &mut DVec3) {
    f.f64_array(name, AsMut::<[f64; 3]>::as_mut(value));
}

/// Column by column.
pub(crate) fn matrix(f: &mut impl Fields, name: &str, value: &mut DMat3) {
    let mut columns = value.to_cols_array();
    f.f64_array(name, &mut columns);
    *value = DMat3::from_cols_array(&columns);
}

/// What may not be there: whether it is, and then its own fields, which stand there in any case.
pub(crate) fn maybe<F: Fields, T: Default>(
    f: &mut F,
    name: &str,
    value: Option<T>,
    visit: impl FnOnce(&mut F, &mut T),
) -> Option<T> {
    let (mut is_there, mut value) = (value.is_some(), value.unwrap_or_default());
    f.bool(name, &mut is_there);
    visit(f, &mut value);
    is_there.then_some(value)
}

/// The message's bytes.
pub fn encode<M: Message>(message: &mut M) -> Vec<u8> {
    let mut encode = Encode(Encoder::default());
    message.visit(&mut encode);
    encode.0.finish()
}

/// The message of these bytes, or `None` where they are something else. No memory is taken for a length that is not
/// there.
pub fn decode<M: Message>(bytes: &[u8]) -> Option<M> {
    let mut decode = Decode { from: Decoder::new(bytes)?, whole: true };
    let mut message = M::empty();
    message.visit(&mut decode);
    decode.whole.then_some(message)
}

/// The message's definition with those of all it holds.
pub fn schema<M: Message>() -> Schema {
    let mut define = Define::default();
    define.message::<M>();
    let rule = "=".repeat(80);
    let mut parts = define.parts.into_iter();
    let (_, mut definition) = parts.next().unwrap_or_default();
    for (name, fields) in parts {
        definition.push_str(&format!("{rule}\nMSG: umbracast_msgs/{name}\n{fields}"));
    }
    definition.push_str(HEADER_DEFINITIONS);
    Schema { name: format!("umbracast_msgs/msg/{}", M::NAME).into(), definition: definition.into() }
}

struct Encode(Encoder);

impl Fields for Encode {
    fn header(&mut self, time_ns: &mut i64) {
        self.0.header(*time_ns, "site");
    }
    fn bool(&mut self, _: &str, value: &mut bool) {
        self.0.bool(*value);
    }
    fn u32(&mut self, _: &str, value: &mut u32) {
        self.0.u32(*value);
    }
    fn u64(&mut self, _: &str, value: &mut u64) {
        self.0.u64(*value);
    }
    fn i64(&mut self, _: &str, value: &mut i64) {
        self.0.u64(*value as u64);
    }
    fn f64(&mut self, _: &str, value: &mut f64) {
        self.0.f64(*value);
    }
    fn string(&mut self, _: &str, value: &mut String) {
        self.0.string(value);
    }
    fn f64_array(&mut self, _: &str, values: &mut [f64]) {
        values.iter().for_each(|value| self.0.f64(*value));
    }
    fn u32_array(&mut self, _: &str, values: &mut [u32]) {
        values.iter().for_each(|value| self.0.u32(*value));
    }
    fn f64_list(&mut self, name: &str, values: &mut Vec<f64>) {
        self.0.u32(values.len() as u32);
        self.f64_array(name, values);
    }
    fn u32_list(&mut self, name: &str, values: &mut Vec<u32>) {
        self.0.u32(values.len() as u32);
        self.u32_array(name, values);
    }
    fn strings(&mut self, _: &str, values: &mut Vec<String>) {
        self.0.u32(values.len() as u32);
        values.iter().for_each(|value| self.0.string(value));
    }
    fn bytes(&mut self, _: &str, value: &mut Vec<u8>) {
        self.0.u32(value.len() as u32);
        self.0.array(value);
    }
    fn one<M: Message>(&mut self, _: &str, value: &mut M) {
        value.visit(self);
    }
    fn list<M: Message>(&mut self, _: &str, values: &mut Vec<M>) {
        self.0.u32(values.len() as u32);
        values.iter_mut().for_each(|value| value.visit(self));
    }
}

/// Reads into fields until one is not there; from then on nothing is read.
struct Decode<'a> {
    from: Decoder<'a>,
    whole: bool,
}

impl<'a> Decode<'a> {
    fn take<T>(&mut self, place: &mut T, read: impl FnOnce(&mut Decoder<'a>) -> Option<T>) {
        match self.whole.then(|| read(&mut self.from)).flatten() {
            Some(value) => *place = value,
            None => self.whole = false,
        }
    }

    /// A list grows with what is there, whatever its length claims.
    fn grow<T>(&mut self, values: &mut Vec<T>, mut read: impl FnMut(&mut Self) -> T) {
        let mut count = 0;
        self.take(&mut count, Decoder::u32);
        for _ in 0..count {
            let value = read(self);
            if !self.whole {
                return;
            }
            values.push(value);
        }
    }
}

impl Fields for Decode<'_> {
    fn header(&mut self, time_ns: &mut i64) {
        self.take(time_ns, |d| {
            let time_ns = d.time()?;
            d.string().map(|_| time_ns)
        });
    }
    fn bool(&mut self, _: &str, value: &mut bool) {
        self.take(value, Decoder::bool);
    }
    fn u32(&mut self, _: &str, value: &mut u32) {
        self.take(value, Decoder::u32);
    }
    fn u64(&mut self, _: &str, value: &mut u64) {
        self.take(value, Decoder::u64);
    }
    fn i64(&mut self, _: &str, value: &mut i64) {
        self.take(value, |d| d.u64().map(|value| value as i64));
    }
    fn f64(&mut self, _: &str, value: &mut f64) {
        self.take(value, Decoder::f64);
    }
    fn string(&mut self, _: &str, value: &mut String) {
        self.take(value, |d| d.string().map(str::to_owned));
    }
    fn f64_array(&mut self, _: &str, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.take(value, Decoder::f64));
    }
    fn u32_array(&mut self, _: &str, values: &mut [u32]) {
        values.iter_mut().for_each(|value| self.take(value, Decoder::u32));
    }
    fn f64_list(&mut self, name: &str, values: &mut Vec<f64>) {
        self.grow(values, |this| {
            let mut value = 0.0;
            this.f64(name, &mut value);
            value
        });
    }
    fn u32_list(&mut self, name: &str, values: &mut Vec<u32>) {
        self.grow(values, |this| {
            let mut value = 0;
            this.u32(name, &mut value);
            value
        });
    }
    fn strings(&mut self, name: &str, values: &mut Vec<String>) {
        self.grow(values, |this| {
            let mut value = String::new();
            this.string(name, &mut value);
            value
        });
    }
    fn bytes(&mut self, _: &str, value: &mut Vec<u8>) {
        self.take(value, |d| {
            let length = d.u32()? as usize;
            d.array(length).map(<[u8]>::to_vec)
        });
    }
    fn one<M: Message>(&mut self, _: &str, value: &mut M) {
        value.visit(self);
    }
    fn list<M: Message>(&mut self, _: &str, values: &mut Vec<M>) {
        self.grow(values, |this| {
            let mut value = M::empty();
            value.visit(this);
            value
        });
    }
}

/// Writes definitions: of the message first, then of those within, each once.
#[derive(Default)]
struct Define {
    parts: Vec<(&'static str, String)>,
    /// The one that is written now.
    at: usize,
}

impl Define {
    fn message<M: Message>(&mut self) {
        if self.parts.iter().any(|(name, _)| *name == M::NAME) {
            return;
        }
        let before = std::mem::replace(&mut self.at, self.parts.len());
        self.parts.push((M::NAME, format!("# {}\n", M::WHAT)));
        M::empty().visit(self);
        self.at = before;
    }

    fn field(&mut self, kind: &str, name: &str) {
        if let Some((_, fields)) = self.parts.get_mut(self.at) {
            fields.push_str(&format!("{kind} {name}\n"));
        }
    }
}

impl Fields for Define {
    fn header(&mut self, _: &mut i64) {
        self.field("std_msgs/Header", "header");
    }
    fn bool(&mut self, name: &str, _: &mut bool) {
        self.field("bool", name);
    }
    fn u32(&mut self, name: &str, _: &mut u32) {
        self.field("uint32", name);
    }
    fn u64(&mut self, name: &str, _: &mut u64) {
        self.field("uint64", name);
    }
    fn i64(&mut self, name: &str, _: &mut i64) {
        self.field("int64", name);
    }
    fn f64(&mut self, name: &str, _: &mut f64) {
        self.field("float64", name);
    }
    fn string(&mut self, name: &str, _: &mut String) {
        self.field("string", name);
    }
    fn f64_array(&mut self, name: &str, values: &mut [f64]) {
        self.field(&format!("float64[{}]", values.len()), name);
    }
    fn u32_array(&mut self, name: &str, values: &mut [u32]) {
        self.field(&format!("uint32[{}]", values.len()), name);
    }
    fn f64_list(&mut self, name: &str, _: &mut Vec<f64>) {
        self.field("float64[]", name);
    }
    fn u32_list(&mut self, name: &str, _: &mut Vec<u32>) {
        self.field("uint32[]", name);
    }
    fn strings(&mut self, name: &str, _: &mut Vec<String>) {
        self.field("string[]", name);
    }
    fn bytes(&mut self, name: &str, _: &mut Vec<u8>) {
        self.field("uint8[]", name);
    }
    fn one<M: Message>(&mut self, name: &str, _: &mut M) {
        self.field(&format!("umbracast_msgs/{}", M::NAME), name);
        self.message::<M>();
    }
    fn list<M: Message>(&mut self, name: &str, _: &mut Vec<M>) {
        self.field(&format!("umbracast_msgs/{}[]", M::NAME), name);
        self.message::<M>();
    }
}
