//! Many pictures on one sheet.

use crate::SrgbImage;

/// How pictures lie on a contact sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetLayout {
    /// Pictures in a row; at least 1.
    pub columns: u32,
    /// Pixels between pictures and around them.
    pub margin: u32,
    /// What shows between them.
    pub background: [u8; 4],
}

impl Default for SheetLayout {
    fn default() -> Self {
        Self { columns: 4, margin: 8, background: [24, 24, 24, 255] }
    }
}

/// Lays pictures in rows, from the top left. Each cell is as large as the largest picture; smaller ones are centred.
#[must_use]
pub fn contact_sheet(pictures: &[SrgbImage], layout: &SheetLayout) -> SrgbImage {
    let columns = layout.columns.max(1).min(pictures.len().max(1) as u32);
    let rows = (pictures.len() as u32).div_ceil(columns);
    let cell_width = pictures.iter().map(|p| p.width).max().unwrap_or(0);
    let cell_height = pictures.iter().map(|p| p.height).max().unwrap_or(0);
    let width = columns * cell_width + (columns + 1) * layout.margin;
    let height = rows * cell_height + (rows + 1) * layout.margin;
    let mut sheet = SrgbImage::filled(width, height, layout.background);
    for (i, picture) in pictures.iter().enumerate() {
        let (column, row) = (i as u32 % columns, i as u32 / columns);
        let left = layout.margin + column * (cell_width + layout.margin) + (cell_width - picture.width) / 2;
        let top = layout.margin + row * (cell_height + layout.margin) + (cell_height - picture.height) / 2;
        for (y, source) in picture.pixels.chunks_exact(picture.width.max(1) as usize).enumerate() {
            let at = (top as usize + y) * width as usize + left as usize;
            sheet.pixels[at..at + source.len()].copy_from_slice(source);
        }
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_lie_in_rows_with_margins() {
        let red = SrgbImage::filled(2, 2, [255, 0, 0, 255]);
        let small = SrgbImage::filled(2, 1, [0, 255, 0, 255]);
        let layout = SheetLayout { columns: 2, margin: 1, background: [0, 0, 0, 255] };
        let sheet = contact_sheet(&[red.clone(), red.clone(), small], &layout);
        assert_eq!((sheet.width, sheet.height), (7, 7));
        assert_eq!(sheet.pixel(1, 1), [255, 0, 0, 255]);
        assert_eq!(sheet.pixel(3, 1), [0, 0, 0, 255]);
        assert_eq!(sheet.pixel(4, 2), [255, 0, 0, 255]);
        assert_eq!(sheet.pixel(1, 4), [0, 255, 0, 255]);
        assert_eq!(sheet.pixel(1, 5), [0, 0, 0, 255]);
        assert!(contact_sheet(&[], &layout).pixels.iter().all(|&p| p == [0, 0, 0, 255]));
    }
}
