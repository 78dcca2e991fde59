//! A table that becomes another: what both have alike stays as it is written, its comments and layout with it.

use toml_edit::{Item, Table, TableLike, Value};

/// Makes one table say what another does; keys that the other lacks go, and new ones stand after those that were there.
pub(super) fn become_table(old: &mut Table, new: &Table) {
    become_like(old, new);
}

fn become_like(old: &mut dyn TableLike, new: &dyn TableLike) {
    let gone: Vec<String> =
        old.iter().map(|(key, _)| key.to_owned()).filter(|key| new.get(key).is_none_or(Item::is_none)).collect();
    for key in gone {
        old.remove(&key);
    }
    for (key, item) in new.iter() {
        match old.get_mut(key) {
            Some(known) => become_item(known, item),
            None => {
                old.insert(key, item.clone());
            }
        }
    }
}

fn become_item(old: &mut Item, new: &Item) {
    if is_alike(old, new) {
        return;
    }
    match (&mut *old, new) {
        (Item::Value(known), Item::Value(value)) => become_value(known, value),
        (known, new) if known.is_table_like() && new.is_table_like() => {
            if let (Some(known), Some(new)) = (known.as_table_like_mut(), new.as_table_like()) {
                become_like(known, new);
            }
        }
        _ => *old = new.clone(),
    }
}

fn become_value(old: &mut Value, new: &Value) {
    if says_the_same(old, new) {
        return;
    }
    match (&mut *old, new) {
        (Value::Array(known), Value::Array(new)) if known.len() == new.len() => {
            known.iter_mut().zip(new.iter()).for_each(|(known, new)| become_value(known, new));
        }
        (Value::InlineTable(known), Value::InlineTable(new)) => become_like(known, new),
        _ => {
            let decor = old.decor().clone();
            *old = new.clone();
            *old.decor_mut() = decor;
        }
    }
}

/// Whether two items say the same, however they are written.
fn is_alike(a: &Item, b: &Item) -> bool {
    let tables = |item: &Item| {
        item.as_array_of_tables().map(|all| all.iter().map(|t| t.clone().into_inline_table()).collect::<Vec<_>>())
    };
    let listed =
        |item: &Item| item.as_array().map(|all| all.iter().filter_map(|v| v.as_inline_table().cloned()).collect::<Vec<_>>());
    match (a.as_value(), b.as_value()) {
        (Some(a), Some(b)) => says_the_same(a, b),
        _ => match (tables(a).or_else(|| listed(a)), tables(b).or_else(|| listed(b))) {
            (Some(a), Some(b)) => a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| has_the_same(a, b)),
            _ => a.as_table_like().zip(b.as_table_like()).is_some_and(|(a, b)| has_the_same(a, b)),
        },
    }
}

fn has_the_same(a: &dyn TableLike, b: &dyn TableLike) -> bool {
    a.len() == b.len() && a.iter().all(|(key, item)| b.get(key).is_some_and(|other| is_alike(item, other)))
}

fn says_the_same(a: &Value, b: &Value) -> bool {
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
    if let (Some(a), Some(b)) = (number(a), number(b)) {
        return a == b;
    }
    match (a, b) {
        (Value::String(a), Value::String(b)) => a.value() == b.value(),
        (Value::Boolean(a), Value::Boolean(b)) => a.value() == b.value(),
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| says_the_same(a, b)),
        (Value::InlineTable(a), Value::InlineTable(b)) => has_the_same(a, b),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toml_edit::DocumentMut;

    #[test]
    fn only_what_differs_is_written_anew() {
        let old = "# a gate\nname = 'gate' # as of old\nsides = 24\npoints = [ # from the left\n  \"a\", \"b\", # the broken one\n  \"c\",\n]\n\
                   rough = 1\non = { top = ['x'] }\n\n[repeat]\ncount = 3 # all\nstep = ['a', \"b\"]\n";
        let turned = |new: &str| {
            let mut table: DocumentMut = old.parse().unwrap();
            become_table(table.as_table_mut(), new.parse::<DocumentMut>().unwrap().as_table());
            table.to_string()
        };
        let same = "name = \"gate\"\nsides = 24.0\npoints = [\"a\", \"b\", \"c\"]\nrough = 1.0\non = { top = [\"x\"] }\nrepeat = { count = 3, step = [\"a\", \"b\"] }";
        assert_eq!(turned(same), old);
        let other = same.replace("\"b\", \"c\"", "\"d\", \"c\"").replace("count = 3", "count = 8").replace("rough = 1.0\n", "");
        let expected = old.replacen("\"b\", #", "\"d\", #", 1).replace("count = 3", "count = 8").replace("rough = 1\n", "");
        assert_eq!(turned(&other), expected);
        let more = turned(&format!("{same}\nmirror = [\"a\"]"));
        assert!(more.contains("# the broken one") && more.contains("\nmirror = [\"a\"]"), "{more}");
    }
}
