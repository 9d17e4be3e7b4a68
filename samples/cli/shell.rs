//! Command lines as a shell reads them back.

/// A word.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Words with spaces between them.
pub fn line<W: AsRef<str>>(words: impl IntoIterator<Item = W>) -> String {
    words.into_iter().map(|word| quoted(word.as_ref())).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_so_that_a_shell_reads_them_back() {
        for word in ["a", "", "my scene's.glb", "$HOME `x` \"y\" \\", "-D", "a;b", "é", "~", "#x", "*"] {
            let out =
                std::process::Command::new("sh").arg("-c").arg(format!("printf %s {}", quoted(word))).output().unwrap();
            assert_eq!(String::from_utf8(out.stdout).unwrap(), word);
        }
        let words = ["a.glb", "my scene.glb", "it's", "-D", "isr.samples=80", ""];
        assert_eq!(line(words), r"a.glb 'my scene.glb' 'it'\''s' -D isr.samples=80 ''");
    }
}
