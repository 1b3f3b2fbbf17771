//! Messages of a rosbag2 recording (`.db3`).

/// The last column of each row of a table, in order: enough of SQLite's file format (sqlite.org/fileformat2) for
/// blobs in a table without deleted rows.
pub fn sqlite_blobs(file: &[u8], table: &str) -> Vec<Vec<u8>> {
    let schema = sqlite_rows(file, 1);
    let row = schema.iter().find(|row| row[1] == table.as_bytes()).expect("the table");
    let root = row[3].iter().fold(0, |sum, &byte| sum << 8 | usize::from(byte));
    sqlite_rows(file, root).into_iter().map(|mut row| row.pop().unwrap()).collect()
}

/// The columns of each row below a page, as bytes.
fn sqlite_rows(file: &[u8], page_number: usize) -> Vec<Vec<Vec<u8>>> {
    let page_size = usize::from(u16::from_be_bytes([file[16], file[17]]));
    let page = &file[(page_number - 1) * page_size..page_number * page_size];
    let head = if page_number == 1 { 100 } else { 0 };
    let u16_at = |at: usize| usize::from(u16::from_be_bytes([page[at], page[at + 1]]));
    let u32_at = |page: &[u8], at: usize| u32::from_be_bytes(page[at..at + 4].try_into().unwrap()) as usize;
    let cells = u16_at(head + 3);
    let is_leaf = page[head] == 13;
    assert!(is_leaf || page[head] == 5, "a table's page");
    let mut rows = Vec::new();
    for cell in 0..cells {
        let mut at = u16_at(head + if is_leaf { 8 } else { 12 } + 2 * cell);
        if !is_leaf {
            rows.extend(sqlite_rows(file, u32_at(page, at)));
            continue;
        }
        let length = varint(page, &mut at);
        varint(page, &mut at);
        // What does not fit into the page goes on in a chain of overflow pages.
        let (most, least) = (page_size - 35, (page_size - 12) * 32 / 255 - 23);
        let fitting = least + (length - least.min(length)) % (page_size - 4);
        let here = if length <= most {
            length
        } else if fitting <= most {
            fitting
        } else {
            least
        };
        let mut record = page[at..at + here].to_vec();
        let mut next = if here < length { u32_at(page, at + here) } else { 0 };
        while next != 0 {
            let overflow = &file[(next - 1) * page_size..next * page_size];
            let take = (length - record.len()).min(page_size - 4);
            record.extend_from_slice(&overflow[4..4 + take]);
            next = u32_at(overflow, 0);
        }
        rows.push(sqlite_columns(&record));
    }
    if !is_leaf {
        rows.extend(sqlite_rows(file, u32_at(page, head + 8)));
    }
    rows
}

fn sqlite_columns(record: &[u8]) -> Vec<Vec<u8>> {
    let mut at = 0;
    let head = varint(record, &mut at);
    let mut body = head;
    let mut columns = Vec::new();
    while at < head {
        let size = match varint(record, &mut at) {
            kind @ 0..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            8 | 9 => 0,
            kind => (kind - 12) / 2,
        };
        columns.push(record[body..body + size].to_vec());
        body += size;
    }
    columns
}

fn varint(bytes: &[u8], at: &mut usize) -> usize {
    let mut value = 0;
    loop {
        let byte = bytes[*at];
        *at += 1;
        value = value << 7 | usize::from(byte & 0x7f);
        if byte < 0x80 {
            return value;
        }
    }
}
