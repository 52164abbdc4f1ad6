//! Names of ports, and ports that are not there.

use super::{AXES, START_RAD, board, quintic, settings};
use crate::device::{DeviceError, Port, Session, Simulated, Tcp, Transport, TransportError};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

#[test]
fn ports_are_named_as_people_type_them() {
    let serial = |path: &str, baud| Port::Serial {
        path: path.into(),
        baud,
    };
    let tcp = |address: &str| Port::Tcp {
        address: address.into(),
    };
    for (name, port) in [
        ("/dev/ttyUSB0", serial("/dev/ttyUSB0", 921_600)),
        ("COM3", serial("COM3", 921_600)),
        ("/dev/ttyACM1@115200", serial("/dev/ttyACM1", 115_200)),
        ("tcp:localhost:4000", tcp("localhost:4000")),
        ("tcp:::1:4000", tcp("::1:4000")),
        ("sim:", Port::Sim),
    ] {
        assert_eq!(name.parse(), Ok(port.clone()), "{name}");
        assert_eq!(port.to_string(), name);
    }
    for name in [
        "",
        "@9600",
        "/dev/ttyS0@fast",
        "/dev/ttyS0@0",
        "tcp:4000",
        "tcp:host:",
        "tcp:host:70000",
        "udp:x:1",
    ] {
        let error = name.parse::<Port>().unwrap_err();
        assert!(error.to_string().contains("sim:"), "{error}");
    }
}

#[test]
fn an_absent_port_says_so() {
    let open = |name: &str| {
        let port: Port = name.parse().unwrap();
        let simulated = || Ok(Box::new(board()) as Box<dyn Transport>);
        port.open(&[], simulated)
            .err()
            .map(|error| error.to_string())
    };
    assert_eq!(open("sim:"), None);
    let words = open("/dev/there-is-no-such-port").unwrap();
    assert!(
        words.contains("there is no port /dev/there-is-no-such-port"),
        "{words}"
    );
    // A port of this computer that was just free.
    let address = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let words = open(&format!("tcp:{address}")).unwrap();
    assert!(words.contains("nobody answers at 127.0.0.1"), "{words}");
}

/// Serves simulated boards, one connection after another, until told to stop.
fn serve(listener: TcpListener, connections: usize, limit_bytes: usize) -> thread::JoinHandle<()> {
    thread::spawn(move || {
        let mut board: Simulated<AXES> = board();
        for connection in 0..connections {
            let (mut stream, _) = listener.accept().unwrap();
            stream
                .set_read_timeout(Some(Duration::from_millis(1)))
                .unwrap();
            let mut received = 0;
            let mut buffer = [0; 512];
            loop {
                match stream.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => {
                        received += count;
                        board.send(&buffer[..count]).unwrap();
                    }
                    Err(_) => {}
                }
                // All but the last connection break down.
                if received > limit_bytes && connection + 1 < connections {
                    break;
                }
                let count = board
                    .receive(&mut buffer, Duration::from_millis(2))
                    .unwrap();
                if stream.write_all(&buffer[..count]).is_err() {
                    break;
                }
            }
        }
    })
}

#[test]
fn an_upload_over_tcp_survives_a_broken_connection() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let server = serve(listener, 2, 900);
    let tcp = Tcp::connect(&address).unwrap();
    let mut session = Session::open(tcp, settings(3)).unwrap();
    let trajectory = quintic(1, 0.3);
    let uploaded = session.upload(&trajectory, |_| {}).unwrap();
    assert_eq!(uploaded.reconnects, 1);
    drop(session);
    server.join().unwrap();
}

#[test]
fn a_silent_tcp_port_is_given_up() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let (done, wait) = mpsc::channel::<()>();
    let server = thread::spawn(move || {
        let stream: (TcpStream, _) = listener.accept().unwrap();
        let _ = wait.recv();
        drop(stream);
    });
    let mut patience = settings(1);
    patience.response_timeout = Duration::from_millis(20);
    let tcp = Tcp::connect(&address).unwrap();
    let error = Session::open(tcp, patience).err().unwrap();
    assert!(
        matches!(error, DeviceError::Silent { attempts: 5, .. }),
        "{error:?}"
    );
    done.send(()).unwrap();
    server.join().unwrap();
    let refused = Tcp::connect(&address).err().unwrap();
    assert!(
        matches!(refused, TransportError::Refused { .. }),
        "{refused:?}"
    );
    assert_eq!(START_RAD.len(), AXES);
}

/// A pseudo-terminal stands in for the wire.
#[cfg(unix)]
#[test]
fn an_upload_over_a_serial_port() {
    use crate::device::Serial;
    use serialport::{SerialPort, TTYPort};
    let (mut wire, end) = TTYPort::pair().unwrap();
    let path = end.name().unwrap();
    drop(end);
    let (done, stop) = mpsc::channel::<()>();
    // Opened before the server begins: a terminal that nobody holds open gives errors to its reader.
    let serial = Serial::open(&path, 115_200).unwrap();
    let server = thread::spawn(move || {
        let mut board: Simulated<AXES> = board();
        wire.set_timeout(Duration::from_millis(1)).unwrap();
        let mut buffer = [0; 512];
        while stop.try_recv() == Err(mpsc::TryRecvError::Empty) {
            if let Ok(count) = wire.read(&mut buffer) {
                board.send(&buffer[..count]).unwrap();
            }
            let count = board
                .receive(&mut buffer, Duration::from_millis(2))
                .unwrap();
            let _ = wire.write_all(&buffer[..count]);
        }
    });
    let mut session = Session::open(serial, settings(3)).unwrap();
    let uploaded = session.upload(&quintic(1, 0.3), |_| {}).unwrap();
    assert_eq!(uploaded.reconnects, 0);
    let busy = Serial::open(&path, 115_200).err().unwrap();
    assert!(matches!(busy, TransportError::Busy { .. }), "{busy:?}");
    let words = busy.to_string();
    assert!(words.contains("in use"), "{words}");
    drop(session);
    done.send(()).unwrap();
    server.join().unwrap();
}
