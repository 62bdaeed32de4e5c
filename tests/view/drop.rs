//! A file that another program drops on the window: the source's side of XDND, version 5.

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

use super::driven::Driven;
use super::harness::Room;

struct Source {
    connection: RustConnection,
    target: u32,
    /// What is dropped: a list of addresses.
    files: String,
}

impl Source {
    fn atom(&self, name: &str) -> u32 {
        let asked = self.connection.intern_atom(false, name.as_bytes());
        asked.expect("sent").reply().expect("an atom").atom
    }

    fn send(&self, kind: &str, data: [u32; 5]) {
        let event = ClientMessageEvent::new(32, self.target, self.atom(kind), data);
        let sent = self
            .connection
            .send_event(false, self.target, EventMask::NO_EVENT, event);
        sent.expect("sent");
        self.connection.flush().expect("sent");
    }

    /// Hands the files out until the window answers so.
    fn wait_for(&self, kind: &str) -> ClientMessageEvent {
        let kind = self.atom(kind);
        loop {
            match self.connection.wait_for_event().expect("an event") {
                Event::SelectionRequest(request) => self.hand_out(&request),
                Event::ClientMessage(answer) if answer.type_ == kind => return answer,
                _ => {}
            }
        }
    }

    fn hand_out(&self, request: &SelectionRequestEvent) {
        let connection = &self.connection;
        let handed = connection.change_property8(
            PropMode::REPLACE,
            request.requestor,
            request.property,
            request.target,
            self.files.as_bytes(),
        );
        handed.expect("sent");
        let told = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: request.time,
            requestor: request.requestor,
            selection: request.selection,
            target: request.target,
            property: request.property,
        };
        let sent = connection.send_event(false, request.requestor, EventMask::NO_EVENT, told);
        sent.expect("sent");
        connection.flush().expect("sent");
    }
}

/// Drops files on the middle of a window.
fn drop_on(driven: &Driven, files: String) {
    let (connection, screen) = x11rb::connect(Some(driven.display())).expect("a display");
    let root = connection.setup().roots[screen].root;
    let window = connection.generate_id().expect("a number");
    connection
        .create_window(
            0,
            window,
            root,
            0,
            0,
            1,
            1,
            0,
            WindowClass::INPUT_ONLY,
            0,
            &CreateWindowAux::new(),
        )
        .expect("sent");
    let source = Source {
        connection,
        target: driven.window(),
        files,
    };
    let aware = source.atom("XdndAware");
    let asked = source
        .connection
        .get_property(false, source.target, aware, AtomEnum::ATOM, 0, 1);
    let aware = asked.expect("sent").reply().expect("a property");
    assert_eq!(aware.value_len, 1, "the window takes nothing");
    let selection = source.atom("XdndSelection");
    let owned = source
        .connection
        .set_selection_owner(window, selection, x11rb::CURRENT_TIME);
    owned.expect("sent");
    let list = source.atom("text/uri-list");
    source.send("XdndEnter", [window, 5 << 24, list, 0, 0]);
    let place = 200 << 16 | 120;
    let copy = source.atom("XdndActionCopy");
    source.send(
        "XdndPosition",
        [window, 0, place, x11rb::CURRENT_TIME, copy],
    );
    let status = source.wait_for("XdndStatus");
    assert_eq!(status.data.as_data32()[1] & 1, 1, "it was refused");
    source.send("XdndDrop", [window, 0, x11rb::CURRENT_TIME, 0, 0]);
    source.wait_for("XdndFinished");
}

/// A scene that is dropped on the window is shown.
#[test]
fn what_is_dropped_is_opened() {
    let room = Room::new();
    let mut driven = Driven::open(&room, "room.toml", "420x700");
    let before = driven.shown();
    assert_eq!(before.one("ComboBox", "").text, "room.toml");
    assert!(before.find("ComboBox", "shading").is_none());
    let address = |name: &str| format!("file://{}\r\n", room.path().join(name).display());
    drop_on(&driven, address("relief.toml"));
    let path = room.path().join("relief.toml").display().to_string();
    driven.until("opened", |shown| {
        shown.one("ComboBox", "").text == path && shown.find("ComboBox", "shading").is_some()
    });
    driven.key("ctrl+q");
    driven.closed();
}
