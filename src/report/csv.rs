//! Tables as text, RFC 4180: written so that a spreadsheet runs nothing in them, read as spreadsheets write them.

/// Characters that begin a formula in Excel, LibreOffice and Google Sheets, with their full-width forms.
const FORMULA_STARTS: [char; 8] = ['=', '+', '-', '@', '＝', '＋', '－', '＠'];

/// Characters that end a cell in some locale: where the comma is the decimal sign, a file is split at semicolons or
/// tabs.
const SEPARATORS: [char; 6] = [',', ';', '\t', '\r', '\n', '"'];

/// A row of a table, with its line end (CR LF).
pub fn format_row(cells: &[String]) -> String {
    cells.iter().map(|c| format_cell(c)).collect::<Vec<_>>().join(",") + "\r\n"
}

/// A cell, quoted if necessary. An apostrophe precedes every character at which a spreadsheet would begin a formula: at
/// the beginning, and after every character that might end a cell. Numbers stay numbers.
pub fn format_cell(text: &str) -> String {
    let text = if text.parse::<f64>().is_ok() { text.to_string() } else { escape_formula(text) };
    match text.contains([',', ';', '\t', '"', '\r', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

fn escape_formula(text: &str) -> String {
    let mut safe = String::with_capacity(text.len() + 2);
    let mut is_at_start = true;
    for letter in text.chars().filter(|c| !matches!(c, '\0'..='\x08' | '\x0b' | '\x0c' | '\x0e'..='\x1f' | '\x7f')) {
        if is_at_start && FORMULA_STARTS.contains(&letter) {
            safe.push('\'');
        }
        is_at_start = SEPARATORS.contains(&letter) || is_at_start && letter.is_whitespace();
        safe.push(letter);
    }
    safe
}

/// The cells of a table, row by row; empty lines are left out. The separator is the one of comma, semicolon and tab
/// that is most frequent in the first line; a byte order mark is skipped.
///
/// # Errors
///
/// When a quotation never ends; the text names the line in which it begins.
pub fn parse_rows(text: &str) -> Result<Vec<Vec<String>>, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let first = text.lines().next().unwrap_or_default();
    let separator = [',', ';', '\t'].into_iter().rev().max_by_key(|s| first.matches(*s).count()).unwrap_or(',');
    let mut rows = Vec::new();
    let (mut row, mut cell) = (Vec::new(), String::new());
    let (mut number, mut quoted_since) = (1, None);
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        number += usize::from(letter == '\n');
        match letter {
            '"' if quoted_since.is_some() && letters.peek() == Some(&'"') => {
                letters.next();
                cell.push('"');
            }
            '"' if quoted_since.is_some() => quoted_since = None,
            '"' if cell.is_empty() => quoted_since = Some(number),
            _ if quoted_since.is_some() => cell.push(letter),
            '\r' if letters.peek() == Some(&'\n') => {}
            '\r' | '\n' => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            _ if letter == separator => row.push(std::mem::take(&mut cell)),
            _ => cell.push(letter),
        }
    }
    if let Some(line) = quoted_since {
        return Err(format!("line {line}: a quotation mark is not closed"));
    }
    row.push(cell);
    rows.push(row);
    rows.retain(|row| row.iter().any(|c| !c.trim().is_empty()));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_person_wrote_is_calculated() {
        for (text, expected) in [
            ("=cmd|'/c calc'!A1", "'=cmd|'/c calc'!A1"),
            ("  @SUM(1)", "  '@SUM(1)"),
            ("＝1+1", "'＝1+1"),
            // A semicolon begins a cell where the comma is the decimal sign.
            ("a;=1+1", "\"a;'=1+1\""),
            ("a\n=1+1", "\"a\n'=1+1\""),
            ("\"=1+1", "\"\"\"'=1+1\""),
            ("-12.5", "-12.5"),
            ("-a", "'-a"),
            ("3-4", "3-4"),
            ("\x1b]0;x\x07", "\"]0;x\""),
        ] {
            assert_eq!(format_cell(text), expected);
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let cells: Vec<String> = ["plain", "a, b", "say \"no\"", "two\nlines", "", "ü"].map(String::from).to_vec();
        assert_eq!(parse_rows(&(format_row(&cells) + &format_row(&cells))).unwrap(), [cells.clone(), cells]);
        assert_eq!(parse_rows("\u{feff}a;b,c;d\r\n1;2;3\r\n\r\n").unwrap(), [["a", "b,c", "d"], ["1", "2", "3"]]);
        assert_eq!(parse_rows("a,b\n\"1,2\n").unwrap_err(), "line 2: a quotation mark is not closed");
    }
}
