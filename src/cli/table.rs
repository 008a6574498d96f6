//! Plain tables for a terminal: the first column to the left, the others to the right, two spaces between.

/// A table under construction.
pub struct Table {
    rows: Vec<Vec<String>>,
    left: usize,
}

impl Table {
    /// A table with these headings; the first `left` columns are aligned to the left.
    pub fn new<const N: usize>(headings: [&str; N], left: usize) -> Self {
        Self { rows: vec![headings.map(str::to_owned).to_vec()], left }
    }

    /// Adds a row.
    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.to_vec());
    }

    /// The table as text, indented by two spaces, each line ended.
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            self.rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let fill = " ".repeat(width.saturating_sub(cell.chars().count()));
                line += "  ";
                line += &if column < self.left { format!("{cell}{fill}") } else { format!("{fill}{cell}") };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}
