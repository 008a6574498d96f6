//! JSON in which no object has a key twice: of two values one would be lost without a word.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use std::fmt;

/// Reads a text, with or without the mark that Windows programs begin it with.
///
/// # Errors
/// It is not JSON, with line and column; or a key is there twice, with its path.
pub fn parse(text: &str) -> Result<Value, serde_json::Error> {
    let mut reader = serde_json::Deserializer::from_str(text.trim_start_matches('\u{feff}'));
    let value = At("").deserialize(&mut reader)?;
    reader.end()?;
    Ok(value)
}

/// Reads the value at a path.
struct At<'p>(&'p str);

impl<'de> DeserializeSeed<'de> for At<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<Value, D::Error> {
        reader.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for At<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Number::from_f64(value).map_or(Value::Null, Value::Number))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element_seed(At(&format!("{}[{}]", self.0, values.len())))? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = object.next_key::<String>()? {
            let path = if self.0.is_empty() { key.clone() } else { format!("{}.{key}", self.0) };
            if map.contains_key(&key) {
                return Err(A::Error::custom(format!("{path} is there twice; keep one of them")));
            }
            let value = object.next_value_seed(At(&path))?;
            map.insert(key, value);
        }
        Ok(Value::Object(map))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reads_what_serde_reads_and_refuses_a_key_that_is_there_twice() {
        let text = r#"{"a":[1,-2,3.5,1e300,null,true,"\u00b5",{"b":{}}],"c":0.1}"#;
        assert_eq!(parse(text).unwrap(), serde_json::from_str::<Value>(text).unwrap());
        assert_eq!(parse("\u{feff}[1]").unwrap(), serde_json::json!([1]));
        for (text, told) in [
            (r#"{"a":[{"b":1},{"b":1,"c":2,"b":1}]}"#, "a[1].b is there twice"),
            ("{\"a\":1,\n\"a\":1}", "a is there twice; keep one of them at line 2"),
            ("[1] 2", "trailing characters"),
            ("{\"a\":1e400}", "out of range"),
            (&"[".repeat(100_000), "recursion limit"),
        ] {
            let why = parse(text).unwrap_err().to_string();
            assert!(why.contains(told), "{why}");
        }
    }
}
