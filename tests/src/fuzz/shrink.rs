//! A failing input made smaller, as long as it fails.

/// Takes out lines, then tokens, in ever smaller runs, while `fails` holds; gives up after so many tries.
pub fn shrunk(text: &str, fails: impl Fn(&str) -> bool) -> String {
    let mut tries = 2000;
    let lines = smaller(text.split_inclusive('\n').collect(), &fails, &mut tries);
    smaller(super::corpus::tokens(&lines), &fails, &mut tries)
}

fn smaller(mut parts: Vec<&str>, fails: &impl Fn(&str) -> bool, tries: &mut usize) -> String {
    let mut run = parts.len() / 2;
    while run > 0 {
        let mut at = 0;
        while at < parts.len() && *tries > 0 {
            let without = [&parts[..at], parts.get(at + run..).unwrap_or_default()].concat();
            *tries -= 1;
            if fails(&without.concat()) { parts = without } else { at += run }
        }
        run /= 2;
    }
    parts.concat()
}

#[cfg(test)]
mod tests {
    use super::shrunk;

    #[test]
    fn what_matters_is_left() {
        let text = "one two\nthree (bad) four\nfive\n";
        assert_eq!(shrunk(text, |text| text.contains("bad")), "bad");
    }
}
