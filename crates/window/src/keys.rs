//! What keys mean, and the list of them that people read.

use winit::{
    event::KeyEvent,
    keyboard::{Key, KeyCode, NamedKey, PhysicalKey},
};

/// Every key and every movement of the mouse, one a line.
pub const KEYS: &str = concat!(
    "  drag                  turn about the point under the cursor, or about the scene's centre\n",
    "  shift or middle drag  move the point under the cursor\n",
    "  wheel                 zoom towards the cursor\n",
    "  F                     frame the whole scene, without clip planes\n",
    "  R                     reset to the scene's camera\n",
    "  O                     orthographic or perspective\n",
    "  S                     save a screenshot under a new name; its camera goes to standard \
     output\n",
    "  H                     list the keys\n",
    "  Esc, Q                quit",
);

/// The same in a line, for the title bar.
pub(super) const SHORT: &str = "drag: turn | shift or middle drag: move | wheel: zoom | F: frame \
                                all | R: reset | O: orthographic or perspective | S: screenshot | \
                                H: keys | Q: quit";

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// Frame the whole scene.
    Frame,
    /// Back to the scene's camera.
    Reset,
    /// The other projection.
    Switch,
    /// A picture into a file.
    Screenshot,
    /// The list of keys.
    Help,
    /// The end.
    Quit,
}

/// The command of a key that goes down, if it has one.
pub(super) fn command(event: &KeyEvent) -> Option<Command> {
    if !event.state.is_pressed() || event.repeat {
        return None;
    }
    match &event.logical_key {
        Key::Named(NamedKey::Escape) => Some(Command::Quit),
        // The letter that is written on the key; where that is no Latin one, the letter at its
        // place on a Latin keyboard.
        Key::Character(text) if text.is_ascii() => match text.to_ascii_lowercase().as_str() {
            "f" => Some(Command::Frame),
            "r" => Some(Command::Reset),
            "o" => Some(Command::Switch),
            "s" => Some(Command::Screenshot),
            "h" => Some(Command::Help),
            "q" => Some(Command::Quit),
            _ => None,
        },
        Key::Character(_) => match event.physical_key {
            PhysicalKey::Code(KeyCode::KeyF) => Some(Command::Frame),
            PhysicalKey::Code(KeyCode::KeyR) => Some(Command::Reset),
            PhysicalKey::Code(KeyCode::KeyO) => Some(Command::Switch),
            PhysicalKey::Code(KeyCode::KeyS) => Some(Command::Screenshot),
            PhysicalKey::Code(KeyCode::KeyH) => Some(Command::Help),
            PhysicalKey::Code(KeyCode::KeyQ) => Some(Command::Quit),
            _ => None,
        },
        _ => None,
    }
}
