//! A session with a board: requests and their responses, again where the line loses them.

use super::error::DeviceError;
use super::receiver::{Received, Receiver, Reception};
use super::transport::{Transport, TransportError};
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use stillpoint_shared::protocol::{
    Denial, Envelope, Greeting, Hello, Identity, MAX_FRAME_BYTES, Message, Request, Response,
    Status, Versions, frame,
};

/// How patient a session is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Time to wait for a response before the request is sent again.
    pub response_timeout: Duration,
    /// The same for requests that write flash, which may have to be erased first.
    pub flash_timeout: Duration,
    /// Times a request is sent at most.
    pub attempts: u32,
    /// Times an upload is taken up again at most after the board or the line was lost.
    pub reconnects: u32,
    /// Where the numbers come from that tell sessions apart; another one in every program that talks to a board.
    pub seed: u64,
}

impl Default for Settings {
    /// One second, ten seconds for flash, five times, three times, and a seed drawn by the system.
    fn default() -> Self {
        Self {
            response_timeout: Duration::from_secs(1),
            flash_timeout: Duration::from_secs(10),
            attempts: 5,
            reconnects: 3,
            seed: RandomState::new().hash_one("session"),
        }
    }
}

/// A session with a board.
pub struct Session<T> {
    pub(super) line: Line<T>,
    identity: Identity,
}

/// The way to a board with what a session needs beside.
pub(super) struct Line<T> {
    pub(super) transport: T,
    pub(super) receiver: Receiver,
    pub(super) settings: Settings,
    envelope: Envelope,
    nonces: u64,
    interrupt: Option<Arc<AtomicBool>>,
}

impl<T: Transport> Session<T> {
    /// Greets the board.
    ///
    /// # Errors
    /// [`DeviceError`] where nobody answers, or speaks another version.
    pub fn open(transport: T, settings: Settings) -> Result<Self, DeviceError> {
        let mut line = Line {
            transport,
            receiver: Receiver::default(),
            settings,
            envelope: Envelope {
                session: 0,
                sequence: settings.seed as u16,
            },
            nonces: settings.seed,
            interrupt: None,
        };
        let identity = line.greet()?;
        Ok(Self { line, identity })
    }

    /// Who is there, as of the last greeting.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The way to the board.
    pub fn transport(&self) -> &T {
        &self.line.transport
    }

    /// The way to the board, to do something with it besides.
    pub fn transport_mut(&mut self) -> &mut T {
        &mut self.line.transport
    }

    /// Counters of what arrived.
    pub fn reception(&self) -> Reception {
        self.line.receiver.reception
    }

    /// How patient the session is.
    pub fn settings(&self) -> &Settings {
        &self.line.settings
    }

    /// From when this is set, everything ends by [`DeviceError::Interrupted`] instead of sending a request, for the first
    /// time or again; with `None` no longer. A request that was sent before may have been obeyed.
    pub fn interrupt_by(&mut self, interrupt: Option<Arc<AtomicBool>>) {
        self.line.interrupt = interrupt;
    }

    /// Looks for the board anew and opens another session. What is loaded, stored and under way on the board stays.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn reconnect(&mut self) -> Result<&Identity, DeviceError> {
        self.line.transport.reconnect()?;
        self.greet()?;
        Ok(&self.identity)
    }

    fn greet(&mut self) -> Result<(), DeviceError> {
        self.identity = self.line.greet()?;
        Ok(())
    }

    /// Sends a request and waits for its response; a denial is an error.
    ///
    /// Where the session turns out to be over, another one is opened; the request is then sent again if doing it twice
    /// is doing it once.
    ///
    /// # Errors
    /// [`DeviceError`], with the board's own words where it refuses.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Response, DeviceError> {
        for _ in 0..self.line.settings.attempts {
            match self.line.exchange(request, self.line.patience(request))? {
                Response::Denied(denial @ Denial::Session { .. }) => {
                    self.greet()?;
                    if !is_repeatable(request) {
                        return Err(DeviceError::SessionLost { denial });
                    }
                }
                Response::Denied(denial) => return Err(DeviceError::Denied(denial)),
                response => return Ok(response),
            }
        }
        let (named, open) = (self.line.envelope.session, 0);
        let denial = Denial::Session { named, open };
        Err(DeviceError::SessionLost { denial })
    }

    /// [`Session::ask`] for a request that is only obeyed or not.
    ///
    /// # Errors
    /// As [`Session::ask`].
    pub fn order(&mut self, request: &Request<'_>) -> Result<(), DeviceError> {
        match self.ask(request)? {
            Response::Done | Response::Upload(_) => Ok(()),
            _ => Err(DeviceError::Unexpected {
                request: name(request),
            }),
        }
    }

    /// How things are.
    ///
    /// # Errors
    /// As [`Session::ask`].
    pub fn status(&mut self) -> Result<Status, DeviceError> {
        match self.ask(&Request::Status)? {
            Response::Status(status) => Ok(status),
            _ => Err(DeviceError::Unexpected { request: "Status" }),
        }
    }

    /// The next sample of telemetry, if one comes in time.
    ///
    /// # Errors
    /// [`DeviceError::Transport`] where the way to the board is gone.
    pub fn telemetry(&mut self, timeout: Duration) -> Result<Option<Received>, DeviceError> {
        let deadline = self.line.transport.now() + timeout;
        while self.line.receiver.telemetry.is_empty() && self.line.transport.now() < deadline {
            if self.line.receive(deadline, true)?.is_some() {
                self.line.receiver.reception.late += 1;
            }
        }
        Ok(self.line.receiver.telemetry.pop_front())
    }

    /// Lets time pass without asking for anything; telemetry is kept.
    ///
    /// # Errors
    /// [`DeviceError::Transport`] where the way to the board is gone.
    pub fn wait(&mut self, time: Duration) -> Result<(), DeviceError> {
        let deadline = self.line.transport.now() + time;
        while self.line.transport.now() < deadline {
            if self.line.receive(deadline, false)?.is_some() {
                self.line.receiver.reception.late += 1;
            }
        }
        Ok(())
    }
}

impl<T: Transport> Line<T> {
    /// Opens a session.
    fn greet(&mut self) -> Result<Identity, DeviceError> {
        self.receiver.restart();
        // A number that no earlier greeting of this program had (a Weyl sequence) nor likely one of another program.
        self.nonces = self.nonces.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let hello = Request::Hello(Hello {
            versions: Versions::OWN,
            nonce: (self.nonces >> 32) as u32,
        });
        self.envelope.session = 0;
        // Ends whatever the board may have half received.
        self.transport.send(&[0])?;
        let (damaged, began) = (self.receiver.reception.damaged, self.transport.now());
        let answer = self.exchange(&hello, self.settings.response_timeout);
        let identity = match answer {
            Ok(Response::Hello(identity)) => identity,
            Ok(_) => return Err(DeviceError::Unexpected { request: "Hello" }),
            Err(DeviceError::Unanswered { attempts, .. }) => {
                return Err(DeviceError::Silent {
                    attempts,
                    waited: self.transport.now() - began,
                    damaged: self.receiver.reception.damaged - damaged,
                });
            }
            Err(error) => return Err(error),
        };
        let Greeting {
            versions: theirs,
            session,
            ref board,
            ref firmware,
            ..
        } = identity.greeting;
        if session == 0 {
            return Err(DeviceError::Versions {
                board: board.to_string(),
                firmware: firmware.to_string(),
                theirs,
                ours: Versions::OWN,
            });
        }
        self.envelope.session = session;
        Ok(identity)
    }

    fn patience(&self, request: &Request<'_>) -> Duration {
        match request {
            Request::Store
            | Request::Erase { .. }
            | Request::SetLimits(_)
            | Request::SetConfig(_)
            | Request::SetDrives { .. } => self.settings.flash_timeout,
            _ => self.settings.response_timeout,
        }
    }

    /// Whether the program is to end.
    pub(super) fn check_interrupt(&self) -> Result<(), DeviceError> {
        match &self.interrupt {
            Some(interrupt) if interrupt.load(Ordering::Relaxed) => Err(DeviceError::Interrupted),
            _ => Ok(()),
        }
    }

    /// Number for a new request.
    pub(super) fn next_sequence(&mut self) -> u16 {
        self.envelope.sequence = self.envelope.sequence.wrapping_add(1);
        self.envelope.sequence
    }

    /// Sends a request under a number.
    pub(super) fn send(&mut self, sequence: u16, request: &Request<'_>) -> Result<(), DeviceError> {
        let envelope = Envelope {
            sequence,
            ..self.envelope
        };
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame =
            frame::encode(envelope, request, &mut buffer).map_err(|_| DeviceError::TooLong {
                request: name(request),
            })?;
        Ok(self.transport.send(frame)?)
    }

    /// Waits until `deadline` for a response of this session.
    pub(super) fn receive(
        &mut self,
        deadline: Duration,
        for_telemetry: bool,
    ) -> Result<Option<(u16, Response)>, TransportError> {
        loop {
            let open = self.envelope.session;
            let next = self
                .receiver
                .next(&mut self.transport, open, deadline, for_telemetry)?;
            match next {
                Some((envelope, Message::Response(response)))
                    if envelope.session == open || matches!(response, Response::Hello(_)) =>
                {
                    return Ok(Some((envelope.sequence, response)));
                }
                Some(_) => self.receiver.reception.late += 1,
                None => return Ok(None),
            }
        }
    }

    /// Sends a request, again and again under the same number, until its response comes.
    fn exchange(
        &mut self,
        request: &Request<'_>,
        timeout: Duration,
    ) -> Result<Response, DeviceError> {
        let sequence = self.next_sequence();
        let greeting = matches!(request, Request::Hello(_));
        let began = self.transport.now();
        let attempts = self.settings.attempts.max(1);
        for _ in 0..attempts {
            self.check_interrupt()?;
            self.send(sequence, request)?;
            let deadline = self.transport.now() + timeout;
            while let Some((answered, response)) = self.receive(deadline, false)? {
                let fits = matches!(response, Response::Hello(_)) == greeting;
                if answered == sequence && (fits || matches!(response, Response::Denied(_))) {
                    return Ok(response);
                }
                self.receiver.reception.late += 1;
            }
        }
        let waited = self.transport.now() - began;
        Err(DeviceError::Unanswered { attempts, waited })
    }
}

/// Whether doing a request twice is doing it once, whatever happened in between.
fn is_repeatable(request: &Request<'_>) -> bool {
    !request.is_order()
        || matches!(
            request,
            Request::Hold
                | Request::QuickStop
                | Request::Override { .. }
                | Request::SetTelemetry(_)
                | Request::UploadBegin(_)
        )
}

/// Name of a request for messages.
fn name(request: &Request<'_>) -> &'static str {
    match request {
        Request::Hello(_) => "Hello",
        Request::UploadBegin(_) | Request::UploadBlock(_) | Request::UploadCommit { .. } => {
            "Upload"
        }
        Request::SetLimits(_) => "SetLimits",
        Request::SetDrives { .. } => "SetDrives",
        Request::SetConfig(_) => "SetConfig",
        Request::SetTelemetry(_) => "SetTelemetry",
        request if request.is_order() => "order",
        _ => "question",
    }
}
