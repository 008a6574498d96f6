//! A check of JSON against the schemas in `schema/`: the keywords they use, and a panic on one that is not known here,
//! so that a schema cannot grow past its check unseen.

use serde_json::Value;

/// Everything in `value` that the schema does not allow, as `path: reason`.
pub fn violations(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, value, "$", &mut found);
    found
}

fn check(schema: &Value, value: &Value, path: &str, found: &mut Vec<String>) {
    let number = value.as_f64().unwrap_or(f64::NAN);
    for (keyword, rule) in schema.as_object().expect("a schema is an object") {
        let bound = rule.as_f64().unwrap_or(f64::NAN);
        let length = value.as_array().map_or(0, Vec::len) as f64;
        let fine = match keyword.as_str() {
            "$schema" | "title" => true,
            "type" => match rule {
                Value::Array(kinds) => kinds.iter().any(|kind| is_kind(value, kind)),
                kind => is_kind(value, kind),
            },
            "const" => value == rule,
            "enum" => rule.as_array().unwrap().contains(value),
            "minimum" => !value.is_number() || number >= bound,
            "maximum" => !value.is_number() || number <= bound,
            "exclusiveMinimum" => !value.is_number() || number > bound,
            "minItems" => !value.is_array() || length >= bound,
            "maxItems" => !value.is_array() || length <= bound,
            "minLength" => value.as_str().is_none_or(|text| text.chars().count() as f64 >= bound),
            "pattern" => value.as_str().is_none_or(|text| matches(text, rule.as_str().unwrap())),
            "required" => value
                .as_object()
                .is_none_or(|map| rule.as_array().unwrap().iter().all(|key| map.contains_key(key.as_str().unwrap()))),
            "properties" => {
                for (key, inner) in rule.as_object().unwrap() {
                    value.get(key).iter().for_each(|v| check(inner, v, &format!("{path}.{key}"), found));
                }
                true
            }
            "additionalProperties" => {
                let named = |key: &str| schema.get("properties").and_then(|p| p.get(key)).is_some();
                for (key, inner) in value.as_object().into_iter().flatten().filter(|(key, _)| !named(key)) {
                    check(rule, inner, &format!("{path}.{key}"), found);
                }
                true
            }
            "items" => {
                for (i, inner) in value.as_array().into_iter().flatten().enumerate() {
                    check(rule, inner, &format!("{path}[{i}]"), found);
                }
                true
            }
            other => panic!("the schema keyword {other:?} is not known to this check"),
        };
        if !fine {
            found.push(format!("{path}: {keyword} {rule}, found {value}"));
        }
    }
}

fn is_kind(value: &Value, kind: &Value) -> bool {
    match kind.as_str().unwrap() {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|n| n.fract() == 0.0),
        "null" => value.is_null(),
        other => panic!("the type {other:?} is not known to this check"),
    }
}

fn matches(text: &str, pattern: &str) -> bool {
    let lower = |c: char| c.is_ascii_lowercase();
    match pattern {
        "^[a-z]$" => text.len() == 1 && text.chars().all(lower),
        "^[a-z][a-z_]*$" => text.starts_with(lower) && text.chars().all(|c| lower(c) || c == '_'),
        other => panic!("the pattern {other:?} is not known to this check"),
    }
}
