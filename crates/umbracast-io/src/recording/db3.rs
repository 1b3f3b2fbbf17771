//! The SQLite storage of rosbag2: a table of topics, and one of messages in the order in which they were recorded.

use std::path::Path;

use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags, OptionalExtension};
use umbracast::Error;

/// One message after the other.
pub struct Messages {
    connection: Connection,
    last_id: i64,
}

impl Messages {
    /// Opens a file; nothing is written to it.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let open = || {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
            let connection = Connection::open_with_flags(path, flags)?;
            // A file from somewhere may bring views and functions of its own.
            connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
            Ok(connection)
        };
        let connection =
            open().map_err(|e: rusqlite::Error| Error::new(e.to_string()).within(path.display()))?;
        Ok(Self { connection, last_id: i64::MIN })
    }

    /// Topic, type and message, in the order of the file.
    pub fn next(&mut self) -> rusqlite::Result<Option<(String, String, Vec<u8>)>> {
        // A query for each message: rows that are held would hold the connection. The order of the join is the index's.
        const NEXT: &str = "SELECT m.id, t.name, t.type, m.data FROM messages AS m CROSS JOIN topics AS t \
                            ON t.id = m.topic_id WHERE m.id > ?1 ORDER BY m.id LIMIT 1";
        let columns = |row: &rusqlite::Row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
        let found = self.connection.query_row(NEXT, [self.last_id], columns).optional()?;
        Ok(found.map(|(id, topic, kind, data)| {
            self.last_id = id;
            (topic, kind, data)
        }))
    }
}
