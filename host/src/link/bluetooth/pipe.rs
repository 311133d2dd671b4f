//! The two ends of a connection as a reader and a writer.

use super::radio::{Line, Send};
use std::io::{self, ErrorKind, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

/// Reading returns within this time.
const LOOK: Duration = Duration::from_millis(50);

/// The end that reads. Its error is [`ErrorKind::TimedOut`] when nothing comes.
#[derive(Debug)]
pub struct Reader {
    received: Receiver<Vec<u8>>,
    piece: Vec<u8>,
    taken: usize,
}

/// The end that writes; dropping it ends the connection.
pub struct Writer {
    send: Send,
    piece: usize,
}

/// Both ends of a connection.
pub fn ends(line: Line) -> (Reader, Writer) {
    let Line { received, send, piece } = line;
    (Reader { received, piece: Vec::new(), taken: 0 }, Writer { send, piece })
}

impl Read for Reader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.piece.len() {
            let next = self.received.recv_timeout(LOOK).map_err(|error| match error {
                RecvTimeoutError::Timeout => ErrorKind::TimedOut.into(),
                RecvTimeoutError::Disconnected => {
                    io::Error::new(ErrorKind::ConnectionReset, "the shoe is out of range, or off")
                }
            });
            // Only when there is one: what was read already must not be read again.
            self.piece = next?;
            self.taken = 0;
        }
        let count = (&self.piece[self.taken..]).read(out)?;
        self.taken += count;
        Ok(count)
    }
}

impl Write for Writer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let piece = &bytes[..bytes.len().min(self.piece)];
        (self.send)(piece)?;
        Ok(piece.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn what_is_written_goes_in_pieces_that_fit() {
        let (sent, pieces) = channel();
        let send = Box::new(move |piece: &[u8]| {
            sent.send(piece.to_vec()).unwrap();
            Ok(())
        });
        let (_, mut writer) = ends(Line { received: channel().1, send, piece: 20 });
        let bytes: Vec<u8> = (0..50).collect();
        writer.write_all(&bytes).unwrap();
        let pieces: Vec<Vec<u8>> = pieces.try_iter().collect();
        assert_eq!(pieces.iter().map(Vec::len).collect::<Vec<_>>(), [20, 20, 10]);
        assert_eq!(pieces.concat(), bytes);
    }

    #[test]
    fn what_comes_is_read_in_order_however_it_is_cut() {
        let (shoe, received) = channel();
        let (mut reader, _) = ends(Line { received, send: Box::new(|_| Ok(())), piece: 20 });
        let bytes: Vec<u8> = (0..=255).collect();
        bytes.chunks(77).for_each(|piece| shoe.send(piece.to_vec()).unwrap());
        shoe.send(Vec::new()).unwrap();
        let (mut read, mut buffer) = (Vec::<u8>::new(), [0; 9]);
        while read.len() < bytes.len() {
            let count = reader.read(&mut buffer).unwrap();
            read.extend(&buffer[..count]);
        }
        assert_eq!(read, bytes);
        assert_eq!(reader.read(&mut buffer).unwrap_err().kind(), ErrorKind::TimedOut);
        shoe.send(vec![7]).unwrap();
        assert_eq!((reader.read(&mut buffer).unwrap(), buffer[0]), (1, 7));
        // What was read is not read again after a silence.
        for _ in 0..2 {
            assert_eq!(reader.read(&mut buffer).unwrap_err().kind(), ErrorKind::TimedOut);
        }
        drop(shoe);
        let gone = reader.read(&mut buffer).unwrap_err();
        assert_eq!(
            (gone.kind(), gone.to_string().as_str()),
            (ErrorKind::ConnectionReset, "the shoe is out of range, or off")
        );
    }
}
