//! The small part of Rust's grammar that shows which names a file uses: words, `::` and single signs, without
//! comments, strings and code under `#[cfg(test)]`.

/// The tokens of a source file.
pub fn tokens(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let mut tokens = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let c = chars[i];
        let next = chars.get(i + 1).copied().unwrap_or(' ');
        if c == '/' && next == '/' {
            while i < chars.len() && chars[i] != '\n' {
                i += 1;
            }
        } else if c == '/' && next == '*' {
            i += 2;
            while i + 1 < chars.len() && (chars[i], chars[i + 1]) != ('*', '/') {
                i += 1;
            }
            i += 2;
        } else if let Some(end) = raw_string_end(&chars, i) {
            i = end;
        } else if c == '"' {
            i += 1;
            while i < chars.len() && chars[i] != '"' {
                i += if chars[i] == '\\' { 2 } else { 1 };
            }
            i += 1;
        } else if c == '\'' {
            i = past_quote(&chars, i);
        } else if c.is_alphanumeric() || c == '_' {
            let start = i;
            while i < chars.len() && (chars[i].is_alphanumeric() || chars[i] == '_') {
                i += 1;
            }
            tokens.push(chars[start..i].iter().collect());
        } else if c == ':' && next == ':' {
            tokens.push("::".to_owned());
            i += 2;
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            i += 1;
        }
    }
    without_tests(tokens)
}

/// The end of `r"..."` or `r#"..."#` that begins at `i`, with or without a `b` before.
fn raw_string_end(chars: &[char], i: usize) -> Option<usize> {
    let before = i.checked_sub(1).map(|at| chars[at]);
    if chars[i] != 'r' || before.is_some_and(|c| c != 'b' && (c.is_alphanumeric() || c == '_')) {
        return None;
    }
    let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
    let mut at = i + 1 + hashes;
    if chars.get(at) != Some(&'"') {
        return None;
    }
    loop {
        at += 1;
        match chars.get(at) {
            None => return Some(at),
            Some('"') if chars[at + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes => {
                return Some(at + 1 + hashes);
            }
            Some(_) => {}
        }
    }
}

/// Past a character literal, or past the quote of a lifetime.
fn past_quote(chars: &[char], i: usize) -> usize {
    match chars.get(i + 1) {
        Some('\\') => chars[i + 3..].iter().position(|c| *c == '\'').map_or(chars.len(), |end| i + 4 + end),
        Some(_) if chars.get(i + 2) == Some(&'\'') => i + 3,
        _ => i + 1,
    }
}

fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let mut kept: Vec<String> = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let attribute = tokens[i..].iter().map(String::as_str).take(7);
        if attribute.eq(["#", "[", "cfg", "(", "test", ")", "]"]) {
            i = past_item(&tokens, i);
        } else {
            kept.push(tokens[i].clone());
            i += 1;
        }
    }
    kept
}

/// Past the item that the attribute at `i` belongs to: its `;`, or the brace that closes it.
fn past_item(tokens: &[String], mut i: usize) -> usize {
    let mut depth = 0;
    while i < tokens.len() {
        match tokens[i].as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        i += 1;
        if depth == 0 && matches!(tokens[i - 1].as_str(), ";" | "}") {
            break;
        }
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_strings_and_tests_are_left_out() {
        let text = "use a::B; // c::D\n let s = \"e::F\"; r#\"g::\"H\"#; let c = 'i'; fn f<'a>(x: &'a str) {}\n\
                    #[cfg(test)]\nmod tests { use j::K; fn g() {} }\nfn l() {}";
        let tokens = tokens(text).join(" ");
        assert_eq!(tokens, "use a :: B ; let s = ; ; let c = ; fn f < a > ( x : & a str ) { } fn l ( ) { }");
    }
}
