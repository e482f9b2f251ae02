//! Pictures of a network: nodes on a bus, and which node receives what from which.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::draw::{FAINT, MUTED, PAPER, document, line, text};
use crate::{BLUE, GREY, INK, ORANGE, PALETTE};

/// A network to draw.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// The first line.
    pub title: String,
    /// The second line.
    pub subtitle: String,
    /// From top to bottom. The first one is the manager, which sends and receives messages without another end.
    pub nodes: Vec<Node>,
}

/// A node.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// What it is called.
    pub name: String,
    /// Further lines about it.
    pub lines: Vec<String>,
    /// Messages that it sends and receives.
    pub messages: Vec<Message>,
}

/// A message that a node sends or receives.
#[derive(Clone, Debug)]
pub struct Message {
    /// The same number in two nodes means the same message.
    pub id: u32,
    /// Whether the node sends it; otherwise it receives it.
    pub is_sent: bool,
    /// Its contents.
    pub what: String,
    /// When it is sent.
    pub note: String,
}

// The layout, in pixels.
const TOP: f64 = 78.0;
const BUS: f64 = 44.0;
const BOX: f64 = 76.0;
const ACROSS: f64 = 190.0;
const MESSAGES: f64 = BOX + ACROSS + 30.0;
/// Where the texts of messages end and the wires begin.
const ENDS: f64 = 800.0;
const LANES: f64 = ENDS + 96.0;
const LANE: f64 = 12.0;
const MESSAGE: f64 = 38.0;
const GAP: f64 = 18.0;
/// The letters that fit in a line, an estimate on the safe side: the font of the viewer is unknown.
const LETTERS: usize = ((ENDS - MESSAGES - 24.0) / 6.6) as usize;
const SMALL_LETTERS: usize = LETTERS * 12 / 11;

/// A message with its position.
struct Row<'a> {
    message: &'a Message,
    y: f64,
}

impl Network {
    /// An SVG document.
    #[must_use]
    pub fn svg(&self) -> String {
        let mut out = String::new();
        text(&mut out, 24.0, 30.0, &self.title, r#"font-size="17" font-weight="bold""#, INK);
        text(&mut out, 24.0, 50.0, &self.subtitle, r#"font-size="13""#, MUTED);
        let (mut top, mut rows, mut taps) = (TOP, Vec::new(), Vec::new());
        for node in &self.nodes {
            let height = (32.0 + 17.0 * node.lines.len() as f64).max(MESSAGE * node.messages.len() as f64 + 8.0);
            draw_node(&mut out, node, top, height);
            taps.push(top + 18.0);
            rows.extend((0..).zip(&node.messages).map(|(at, message)| {
                let y = top + 4.0 + MESSAGE * f64::from(at);
                Row { message, y }
            }));
            top += height + GAP;
        }
        let bottom = taps.last().copied().unwrap_or(TOP) + 18.0;
        for y in &taps {
            line(&mut out, (BUS, *y), (BOX, *y), BLUE, r#"stroke-width="3""#);
        }
        line(&mut out, (BUS, TOP), (BUS, bottom), BLUE, r#"stroke-width="5" stroke-linecap="round""#);
        for y in [TOP, bottom] {
            line(&mut out, (BUS - 9.0, y), (BUS + 9.0, y), BLUE, r#"stroke-width="3" stroke-linecap="round""#);
        }
        rows.iter().for_each(|row| row.draw(&mut out));
        let lanes = draw_wires(&mut out, &rows);
        document(&out, LANES + LANE * lanes as f64 + 24.0, top + 6.0)
    }
}

fn draw_node(out: &mut String, node: &Node, top: f64, height: f64) {
    let _ = writeln!(
        out,
        r#"<rect x="{BOX:.1}" y="{top:.1}" width="{ACROSS:.1}" height="{height:.1}" rx="5" fill="{PAPER}" stroke="{GREY}"/>"#
    );
    text(out, BOX + 12.0, top + 22.0, &node.name, r#"font-size="14" font-weight="bold""#, INK);
    for (line, at) in node.lines.iter().zip(1..) {
        text(out, BOX + 12.0, top + 23.0 + 17.0 * f64::from(at), &cut(line, 27), "", MUTED);
    }
}

impl Row<'_> {
    fn draw(&self, out: &mut String) {
        let Message { is_sent, what, note, .. } = self.message;
        let (y, left) = (self.y + 12.0, MESSAGES - 14.0);
        // Sent messages point away from the node, received ones to it.
        let (tip, tail, color) = if *is_sent { (left + 8.0, left, BLUE) } else { (left, left + 8.0, ORANGE) };
        let _ = writeln!(
            out,
            r#"<path d="M{tail:.1} {:.1}L{tip:.1} {y:.1}L{tail:.1} {:.1}Z" fill="{color}"/>"#,
            y - 5.0,
            y + 5.0
        );
        text(out, MESSAGES + 4.0, y + 4.0, &cut(what, LETTERS), "", INK);
        text(out, MESSAGES + 4.0, y + 19.0, &cut(note, SMALL_LETTERS), r#"font-size="11""#, MUTED);
    }
}

/// Connects senders with receivers; messages that would overlap get separate lanes. A message without another end is
/// connected to the manager. Returns the number of lanes.
fn draw_wires(out: &mut String, rows: &[Row<'_>]) -> usize {
    let mut wires: BTreeMap<u32, Vec<&Row<'_>>> = BTreeMap::new();
    rows.iter().for_each(|row| wires.entry(row.message.id).or_default().push(row));
    let is_wire = |ends: &Vec<&Row<'_>>| [true, false].map(|sent| ends.iter().any(|row| row.message.is_sent == sent));
    let (wires, alone): (Vec<_>, Vec<_>) = wires.into_values().partition(|ends| is_wire(ends) == [true, true]);
    for row in alone.into_iter().flatten() {
        let y = row.y + 12.0;
        line(out, (ENDS, y), (ENDS + 14.0, y), GREY, "");
        let _ = writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="62" height="18" rx="9" fill="{FAINT}"/>"#,
            ENDS + 14.0,
            y - 9.0
        );
        text(out, ENDS + 45.0, y + 4.0, "manager", r#"text-anchor="middle" font-size="11""#, MUTED);
    }
    // The position from which each lane is free.
    let mut lanes: Vec<f64> = Vec::new();
    let mut wires: Vec<_> = wires.into_iter().map(|ends| (ends[0].y, ends[ends.len() - 1].y, ends)).collect();
    wires.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (number, (first, last, ends)) in wires.into_iter().enumerate() {
        let lane = lanes.iter().position(|free| *free < first).unwrap_or(lanes.len());
        lanes.resize(lanes.len().max(lane + 1), 0.0);
        lanes[lane] = last;
        let (x, color) = (LANES + LANE * lane as f64, PALETTE[number % PALETTE.len()]);
        line(out, (x, first + 12.0), (x, last + 12.0), color, r#"stroke-width="2" stroke-linecap="round""#);
        for row in ends {
            let y = row.y + 12.0;
            line(out, (ENDS, y), (x, y), color, r#"stroke-width="2""#);
            if row.message.is_sent {
                let _ = writeln!(out, r#"<circle cx="{ENDS:.1}" cy="{y:.1}" r="4" fill="{color}"/>"#);
            } else {
                let _ = writeln!(
                    out,
                    r#"<path d="M{:.1} {:.1}L{ENDS:.1} {y:.1}L{:.1} {:.1}Z" fill="{color}"/>"#,
                    ENDS + 10.0,
                    y - 5.0,
                    ENDS + 10.0,
                    y + 5.0
                );
            }
        }
    }
    lanes.len()
}

/// The beginning of a text, as far as it fits.
fn cut(text: &str, letters: usize) -> String {
    match text.char_indices().nth(letters) {
        None => text.to_owned(),
        Some(_) => text.chars().take(letters - 1).chain(['…']).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_connects_who_sends_it_with_all_who_receive_it() {
        let message = |id, is_sent| Message { id, is_sent, what: format!("<{id}>"), note: String::new() };
        let node = |name: &str, messages| Node { name: name.to_owned(), lines: Vec::new(), messages };
        let nodes = vec![
            node("manager", vec![]),
            node("a", vec![message(1, true), message(2, true)]),
            node("b", vec![message(1, false), message(3, true), message(3, false)]),
            node("c", vec![message(1, false)]),
        ];
        let svg = Network { title: "A & B".to_owned(), subtitle: String::new(), nodes }.svg();
        assert!(svg.contains("A &amp; B") && svg.contains("&lt;2>"));
        // One for the message that nobody receives.
        assert_eq!(svg.matches(">manager</text>").count(), 2);
        assert_eq!(svg.matches("<circle").count(), 2);
        // One message passes three nodes, and the other one is beside it.
        assert!(svg.contains(&format!("width=\"{}\"", LANES + 2.0 * LANE + 24.0)), "{svg}");
    }
}
