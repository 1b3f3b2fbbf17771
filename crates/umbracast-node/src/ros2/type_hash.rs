//! The hash of a message type, `RIHS01`: SHA-256 of its description as JSON, spaces and order of keys included. The form is
//! that of REP-2016 and `rosidl_generator_type_description`.

use std::collections::BTreeMap;
use std::fmt::Write;

use sha2::{Digest, Sha256};
use umbracast::Error;
use umbracast_io::messages::Schema;

/// Numbers of `type_description_interfaces/msg/FieldType`.
const NESTED: u32 = 1;
const PLAIN: [(&str, u32); 16] = [
    ("int8", 2),
    ("uint8", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("char", 3), // In definitions of messages a byte without a sign.
    ("bool", 15),
    ("byte", 16),
    ("string", 17),
    ("wstring", 18),
    ("string<=", 21),
];
/// Added to a type's number for an array of fixed length, a sequence of bounded length and one of any length.
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

/// A field: its name, and its type as far as the hash knows it.
struct Field<'a> {
    name: &'a str,
    number: u32,
    capacity: u64,
    string_capacity: u64,
    /// `package/msg/Type` of a message.
    nested: String,
}

/// `RIHS01_` and 64 digits.
///
/// # Errors
/// A field of a type that the definition does not hold.
pub fn type_hash(schema: &Schema) -> Result<String, Error> {
    let types = parse(schema)?;
    let mut used = BTreeMap::new();
    collect(&schema.name, &types, &mut used)?;
    let own = used.remove(schema.name.as_ref()).unwrap_or_default();
    let others: Vec<String> = used.into_values().collect();
    let text =
        format!("{{\"type_description\": {own}, \"referenced_type_descriptions\": [{}]}}", others.join(", "));
    let mut hash = "RIHS01_".to_owned();
    for byte in Sha256::digest(text.as_bytes()) {
        let _ = write!(hash, "{byte:02x}"); // To a string: cannot fail.
    }
    Ok(hash)
}

/// Every type of a definition by name, the message's own first.
fn parse(schema: &Schema) -> Result<BTreeMap<String, Vec<Field<'_>>>, Error> {
    let is_rule = |line: &str| line.len() >= 3 && line.chars().all(|c| c == '=');
    let mut types: BTreeMap<String, Vec<Field>> = BTreeMap::new();
    let mut name = schema.name.to_string();
    types.insert(name.clone(), Vec::new());
    for line in schema.definition.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if let Some(other) = line.strip_prefix("MSG: ") {
            name = full_name(other, "");
            types.insert(name.clone(), Vec::new());
        } else if !line.is_empty() && !is_rule(line) {
            let package = name.split('/').next().unwrap_or_default();
            let field = field(line, package).map_err(|e| e.within(&name))?;
            if let (Some(field), Some(fields)) = (field, types.get_mut(&name)) {
                fields.push(field);
            }
        }
    }
    Ok(types)
}

/// None for a constant.
fn field<'a>(line: &'a str, package: &str) -> Result<Option<Field<'a>>, Error> {
    let wrong = || Error::new(format!("expected a type and a name, found {line:?}"));
    let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(wrong)?;
    if rest.contains('=') {
        return Ok(None);
    }
    let name = rest.split_whitespace().next().ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<u64>().map_err(|_| wrong());
    let (base, many, capacity) = match kind.strip_suffix(']').and_then(|kind| kind.rsplit_once('[')) {
        None => (kind, 0, 0),
        Some((base, "")) => (base, SEQUENCE, 0),
        Some((base, length)) => match length.strip_prefix("<=") {
            Some(most) => (base, BOUNDED_SEQUENCE, number(most)?),
            None => (base, ARRAY, number(length)?),
        },
    };
    let (base, string_capacity) = match base.strip_prefix("string<=") {
        Some(most) => ("string<=", number(most)?),
        None => (base, 0),
    };
    let plain = PLAIN.iter().find(|(name, _)| *name == base);
    let nested = if plain.is_none() { full_name(base, package) } else { String::new() };
    let number = plain.map_or(NESTED, |(_, number)| *number) + many;
    Ok(Some(Field { name, number, capacity, string_capacity, nested }))
}

/// `package/msg/Type` of `package/Type`, of itself, and of a `Type` beside the one that names it.
fn full_name(name: &str, package: &str) -> String {
    match name.split_once('/') {
        None => format!("{package}/msg/{name}"),
        Some((_, rest)) if rest.contains('/') => name.to_owned(),
        Some((package, rest)) => format!("{package}/msg/{rest}"),
    }
}

/// The descriptions of a type and of all that it is made of.
fn collect(
    name: &str,
    types: &BTreeMap<String, Vec<Field>>,
    used: &mut BTreeMap<String, String>,
) -> Result<(), Error> {
    if used.contains_key(name) {
        return Ok(());
    }
    let fields =
        types.get(name).ok_or_else(|| Error::new(format!("expected a definition of {name}, found none")))?;
    let of_field = |field: &Field| {
        let Field { name, number, capacity, string_capacity, nested } = field;
        format!(
            "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {number}, \"capacity\": {capacity}, \
             \"string_capacity\": {string_capacity}, \"nested_type_name\": \"{nested}\"}}}}"
        )
    };
    let described: Vec<String> = fields.iter().map(of_field).collect();
    used.insert(
        name.to_owned(),
        format!("{{\"type_name\": \"{name}\", \"fields\": [{}]}}", described.join(", ")),
    );
    fields.iter().filter(|field| !field.nested.is_empty()).try_for_each(|f| collect(&f.nested, types, used))
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast_io::messages;

    /// As `rosidl` of Jazzy computes them.
    #[test]
    fn well_known_types_have_their_hashes() {
        for (schema, expected) in [
            (messages::CONFIG, "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
            (messages::CLOUD, "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"),
            (messages::TRANSFORMS, "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
        ] {
            assert_eq!(type_hash(&schema).unwrap(), expected, "{}", schema.name);
        }
    }

    #[test]
    fn arrays_sequences_and_bounds_are_told_apart() {
        let of = |kind: &str| {
            let name = "a/msg/B".into();
            type_hash(&Schema { name, definition: format!("{kind} value\n").into() }).unwrap()
        };
        let kinds =
            ["uint8", "uint8[]", "uint8[4]", "uint8[<=4]", "uint8[5]", "string", "string<=4", "string<=5"];
        let hashes: std::collections::BTreeSet<String> = kinds.iter().map(|kind| of(kind)).collect();
        assert_eq!(hashes.len(), kinds.len());
        let plain = Schema { name: "a/msg/B".into(), definition: "uint8 value 7 # why\nuint8 C=7\n".into() };
        assert_eq!(type_hash(&plain).unwrap(), of("uint8"), "defaults, constants and comments do not count");
    }

    #[test]
    fn a_type_that_is_not_defined_is_named() {
        let schema = Schema { name: "a/msg/B".into(), definition: "other/Thing thing\n".into() };
        let message = type_hash(&schema).unwrap_err().to_string();
        assert!(message.contains("other/msg/Thing"), "{message}");
    }
}
