// Made of the bench's types: LEXICAN_BLESS=1 cargo test -p lexican-bench golden

/**
 * What a request brings.
 */
export type Answer = "done" | { "objects": Array<Object> } | { "values": Array<Value> } | { "differences": Array<Difference> } | { "pdos": Array<Pdo> } | { "objections": Array<string> } | { "frames": Frames } | { "curves": Array<Curve> } | { "number": number };

export type Bus = { 
/**
 * `can0`, `demo`, `bus.log`.
 */
name: string, is_writable: boolean, 
/**
 * In bits per second, if it is known.
 */
bit_rate: number | null, 
/**
 * `active`, `off`, as the controller has it; why it is lost.
 */
state: string, frames: number, 
/**
 * In the last second.
 */
frames_per_second: number, 
/**
 * In the last second, if the bit rate is known.
 */
load_percent: number | null, 
/**
 * The most in any second.
 */
load_percent_peak: number | null, 
/**
 * Lost between the controller and us.
 */
missing_frames: number, 
/**
 * By COB-ID.
 */
ids: Array<Rate>, 
/**
 * What is wrong on the bus, who does it, and what to do, in sentences.
 */
troubles: Array<Trouble>, };

/**
 * What an answer has in it: a file is fetched from its address.
 */
export type Content = { "file": { name: string, url: string, bytes: number, } } | Answer;

/**
 * Who may change something.
 */
export type Control = { 
/**
 * The number of the client that has control.
 */
holder: number | null, 
/**
 * How many clients are open.
 */
clients: number, };

/**
 * A curve of the plot.
 */
export type Curve = { node: number, 
/**
 * `6064:00`.
 */
address: string, name: string, unit: string | null, 
/**
 * When its last number was seen.
 */
seen: Seen | null, 
/**
 * Time and number, ascending in time.
 */
points: Array<[number, number]>, };

/**
 * A parameter that differs.
 */
export type Difference = { 
/**
 * `6081:00`.
 */
address: string, name: string, 
/**
 * In the node, in words.
 */
here: string, 
/**
 * In the other one, in words.
 */
there: string, };

export type Drive = { node: number, 
/**
 * Its name, as in [`Node::name`].
 */
name: string, 
/**
 * The state of its state machine (CiA 402): `OPERATION ENABLED`; None while unknown.
 */
state: string | null, 
/**
 * The states that it may be ordered to from here.
 */
allowed: Array<string>, 
/**
 * When its state, position and velocity were as they are shown: the oldest of them.
 */
seen: Seen | null, 
/**
 * Its operating mode, in words.
 */
mode: string | null, 
/**
 * In its unit.
 */
position: number | null, 
/**
 * `deg`; None for increments.
 */
position_unit: string | null, 
/**
 * In its unit.
 */
velocity: number | null, 
/**
 * `rpm`.
 */
velocity_unit: string | null, 
/**
 * Where the present travel goes.
 */
target: number | null, 
/**
 * What an order would be refused for now, in sentences; empty if it would move. `None` while nobody has looked: that is done
 * while a client has control.
 */
obstacles: Array<string> | null, 
/**
 * The order under way, in words.
 */
order: string | null, 
/**
 * How the last order ended.
 */
ending: Ending | null, 
/**
 * A stop that was ordered, until the drive confirms that it stands.
 */
unconfirmed: Unconfirmed | null, 
/**
 * The orders that this drive knows.
 */
orders: Array<Verb>, 
/**
 * The homing methods that it has.
 */
homing_methods: Array<number>, };

/**
 * How an order has ended.
 */
export type Ending = { is_success: boolean, 
/**
 * Whether the drive may still be moving: it could not be told to stop.
 */
may_be_moving: boolean, text: string, remedy: string | null, };

/**
 * An emergency.
 */
export type Fault = { 
/**
 * When it came.
 */
at: number, 
/**
 * `3210`.
 */
code: string, 
/**
 * `DC link over-voltage; the brake resistor is too small`.
 */
text: string, row: number, };

/**
 * Rows of the trace that match a filter.
 */
export type Frames = { 
/**
 * How many rows match, of those that are kept.
 */
matching: number, 
/**
 * The place of the first of these rows among them.
 */
from: number, rows: Array<Row>, };

/**
 * Something that can be done to a simulated device.
 */
export type Input = { 
/**
 * `shaft`.
 */
name: string, 
/**
 * What it is, in a sentence.
 */
help: string, 
/**
 * What it takes: `free`, `blocked`; empty for a number.
 */
choices: Array<string>, 
/**
 * What it is now.
 */
value: string | null, };

/**
 * Something that takes its time.
 */
export type Job = { 
/**
 * From 1.
 */
number: number, 
/**
 * `restore of node 5`.
 */
name: string, 
/**
 * 0 to 1, if it is known.
 */
done: number | null, 
/**
 * Where it is: `6081:00 Profile velocity`; its end in words.
 */
text: string, 
/**
 * How it has ended; None while it runs.
 */
is_success: boolean | null, };

/**
 * What people keep of a machine, besides what they watch.
 */
export type Kept = { 
/**
 * The sequences that its file lists.
 */
sequences: Array<string>, 
/**
 * The messages that it lists: each is played as a sequence of one line is, without stopping the drives at its end.
 */
messages: Array<string>, 
/**
 * The filters of the trace that it lists, by name.
 */
filters: Array<[string, TraceFilter]>, 
/**
 * While what somebody does is recorded: how many lines there are.
 */
recorded: number | null, };

/**
 * Something that a drive or its data sheet lacks.
 */
export type Lack = { 
/**
 * Whether the drive cannot be moved without it.
 */
is_needed: boolean, 
/**
 * What is missing, or used instead, with its remedy.
 */
text: string, };

export type Log = { seconds: number, 
/**
 * Where it stands.
 */
position: number, 
/**
 * 0 if it stands.
 */
speed: number, };

/**
 * A command of network management (CiA 301, 7.2.8.2).
 */
export type Nmt = "start" | "stop" | "pre-operational" | "reset-node" | "reset-communication";

export type Node = { id: number, 
/**
 * What the plant calls it, else its device's name (1008h), else that of its data sheet.
 */
name: string, 
/**
 * The data sheet: `siko/ag03-1`.
 */
sheet: string | null, 
/**
 * Whether it has one in it (1021h) that is not used.
 */
stores_sheet: boolean, 
/**
 * 1018h, as far as it was read: vendor, product, revision, serial number.
 */
identity: [number | null, number | null, number | null, number | null], 
/**
 * `OPERATIONAL`; None while unknown.
 */
state: string | null, 
/**
 * When it was in this state.
 */
seen: Seen | null, 
/**
 * The time between its heartbeats in ms.
 */
heartbeat_ms: number | null, 
/**
 * For how long it has been silent, if it should not be.
 */
silent_seconds: number | null, 
/**
 * Its present faults, in words; empty if it has none.
 */
faults: Array<Fault>, 
/**
 * Those before, newest first.
 */
history: Array<Fault>, 
/**
 * The median of the SDO response times in ms.
 */
sdo_ms: number | null, aborts: number, boots: number, 
/**
 * What its data sheet, and then the drive itself, lacks for moving it, and what is used instead.
 */
lacks: Array<Lack>, 
/**
 * What has changed since the bench was opened: `the state: PRE-OPERATIONAL, now OPERATIONAL`.
 */
changes: Array<string>, };

/**
 * An entry of a data sheet.
 */
export type Object = { 
/**
 * `6081:00`.
 */
address: string, 
/**
 * The name of its object.
 */
object: string, 
/**
 * Its own name; that of its object if it is the only entry.
 */
name: string, 
/**
 * Where it belongs: `Communication`, `Manufacturer`, `Drive`.
 */
group: string, 
/**
 * `UNSIGNED32`.
 */
data_type: string, 
/**
 * Its size in a frame; `None` if it has none of its own.
 */
bits: number | null, 
/**
 * `rw`, `ro`, `wo`, `const`.
 */
access: string, 
/**
 * `tpdo`, `rpdo`, `both`; None if it cannot be mapped.
 */
mappable: string | null, 
/**
 * Its default in words.
 */
default: string | null, low: string | null, high: string | null, 
/**
 * The names that it takes, if it is an enumeration or has bits.
 */
choices: Array<string>, unit: string | null, 
/**
 * What the data sheet says of it.
 */
help: string | null, 
/**
 * The last known value.
 */
value: Value | null, };

/**
 * What to compare parameters with.
 */
export type Other = "defaults" | { "dcf": string } | { "node": number };

export type Pdo = { 
/**
 * `TPDO1`.
 */
name: string, 
/**
 * `185`.
 */
id: string, is_on: boolean, 
/**
 * `event-driven`, `every 2nd SYNC`.
 */
transmission: string, 
/**
 * In ms, if it has one.
 */
event_timer_ms: number | null, 
/**
 * Between frames, if it has one.
 */
inhibit_ms: number | null, 
/**
 * What it carries, from bit 0 on.
 */
fields: Array<PdoField>, 
/**
 * Frames in the last second.
 */
per_second: number, conflict: string | null, 
/**
 * The entries that may be mapped into it: address and name.
 */
mappable: Array<[string, string]>, };

/**
 * An object in a PDO.
 */
export type PdoField = { 
/**
 * `6041:00`.
 */
address: string, name: string, 
/**
 * The first bit.
 */
first_bit: number, bits: number, 
/**
 * Its last value in words.
 */
text: string | null, 
/**
 * When that was seen, in seconds of [`View::time`].
 */
at: number | null, };

/**
 * The frames of a COB-ID.
 */
export type Rate = { 
/**
 * `185`.
 */
id: string, 
/**
 * `TPDO1`.
 */
name: string, 
/**
 * Whose it is.
 */
node: number | null, frames: number, 
/**
 * In the last second.
 */
per_second: number, 
/**
 * How far the time from frame to frame deviates, as its standard deviation in ms.
 */
jitter_ms: number | null, 
/**
 * Its part of all bits of the last second.
 */
share_percent: number, };

/**
 * Why a request was not carried out.
 */
export type Refused = { 
/**
 * What is wrong, with node, index and value.
 */
why: string, 
/**
 * What to do.
 */
remedy: string | null, };

/**
 * A request of a client. What changes something on the bus needs control ([`Request::TakeControl`]), but for
 * [`Request::StopAll`].
 *
 * In JSON: `{"do": "write", "node": 5, "address": "6081:00", "text": "100 rpm"}`.
 */
export type Request = { "do": "take-control", 
/**
 * Take it from the client that has it; what it started is stopped.
 */
force: boolean, } | { "do": "release-control" } | { "do": "stop-all" } | { "do": "nmt", 
/**
 * `None` for all.
 */
node: number | null, command: Nmt, } | { "do": "acknowledge" } | { "do": "scan" } | { "do": "set-sheet", node: number, 
/**
 * `siko/ag03-1`, `drive.eds`.
 */
sheet: string, } | { "do": "fetch-sheet", node: number, } | { "do": "assign", node: number, } | { "do": "objects", node: number, } | { "do": "read", node: number, 
/**
 * `6064:00`; `1018` for all entries of an object.
 */
addresses: Array<string>, } | { "do": "seen", node: number, addresses: Array<string>, } | { "do": "write", node: number, address: string, 
/**
 * As `lexican write` takes it: `100 rpm`, `profile position`, `0x1F`.
 */
text: string, 
/**
 * Send what the data sheet does not allow.
 */
force: boolean, } | { "do": "watch", node: number, address: string, 
/**
 * How often, at least every 10 ms.
 */
every_ms: number, } | { "do": "unwatch", node: number, address: string, } | { "do": "compare", node: number, with: Other, } | { "do": "backup", node: number, } | { "do": "restore", node: number, dcf: string, } | { "do": "pdos", node: number, } | { "do": "map-pdo", node: number, 
/**
 * `tpdo1`.
 */
pdo: string, objects: Array<string>, 
/**
 * `event`, `sync`, `sync:4`, `every:10ms`; as it is without it.
 */
transmission: string | null, check: boolean, } | { "do": "trace", 
/**
 * Which frames, in the words of `lexican monitor`; all without it.
 */
filter: TraceFilter, 
/**
 * The first row, counted from the oldest one that is kept and matches; from the end backwards if negative.
 */
from: number, 
/**
 * Counted from the first row that matches and has this number or a higher one: so rows stay where they are when
 * older ones are forgotten.
 */
at?: number | null, 
/**
 * How many, at most 1,000.
 */
count: number, } | { "do": "export", 
/**
 * By its name, as `lexican convert` takes it.
 */
format: string, filter: TraceFilter, } | { "do": "plot", node: number, 
/**
 * `6064:00`, `tpdo1`.
 */
signals: Array<string>, 
/**
 * How often objects are read.
 */
every_ms: number, } | { "do": "clear-plot", 
/**
 * `None` for all.
 */
node: number | null, } | { "do": "curves", 
/**
 * In seconds of [`View::time`](crate::View::time).
 */
since: number, } | { "do": "number", 
/**
 * `12.5`.
 */
text: string, } | { "do": "export-plot", 
/**
 * `csv` or `svg`.
 */
format: string, } | { "do": "drive", node: number, order: Verb, 
/**
 * A position, a distance or a velocity with or without unit (`90 deg`), or a homing method.
 */
value: string | null, } | { "do": "record", on: boolean, } | { "do": "play-sequence", name: string, 
/**
 * Its lines; without them it is one of [`Kept::sequences`](crate::view::Kept::sequences).
 */
text: string | null, } | { "do": "input", node: number, text: string, } | { "do": "power", node: number, on: boolean, } | { "do": "seek", 
/**
 * In seconds from its first frame.
 */
seconds: number, } | { "do": "play", 
/**
 * 1 for the speed of its recording; 0 stands.
 */
speed: number, };

/**
 * A frame, or an SDO transfer, in words.
 */
export type Row = { 
/**
 * The frame's number from 0; a transfer has that of its last frame.
 */
number: number, time: number, 
/**
 * `185`.
 */
id: string, 
/**
 * `06 02 00 00`.
 */
data: string, 
/**
 * The node, if it is one.
 */
node: number | null, 
/**
 * `TPDO1`.
 */
service: string, text: string, 
/**
 * Whether it is or reports an error.
 */
alarming: boolean, };

/**
 * When something was as it is shown.
 */
export type Seen = { 
/**
 * In seconds of [`View::time`].
 */
at: number, 
/**
 * It should have been seen again since: how it is now is unknown.
 */
is_old: boolean, };

export type Simulated = { node: number, 
/**
 * What the plant calls it.
 */
name: string, is_on: boolean, 
/**
 * What can be done to it.
 */
inputs: Array<Input>, };

/**
 * A message to a page, besides the view ([`Fields`](super::changes::Fields)).
 */
export type ToPage = { "hello": { client: number, version: string, } } | { id: number, } & ({ "answer": Content } | { "refused": Refused });

/**
 * The extent of the trace.
 */
export type Trace = { 
/**
 * The number of the oldest frame that is kept.
 */
first: number, 
/**
 * The number after that of the newest one.
 */
end: number, };

/**
 * Which frames of the trace, in the words of `lexican monitor`'s options.
 */
export type TraceFilter = { 
/**
 * `5`, `3,5-9`.
 */
nodes: string, 
/**
 * `sdo,emcy`.
 */
services: string, 
/**
 * `sync,heartbeat`.
 */
without: string, 
/**
 * `Statusword`, `6041`.
 */
object: string, 
/**
 * `180-1FF`.
 */
ids: string, 
/**
 * A part of the text.
 */
text: string, 
/**
 * Only what reports an error.
 */
alarming: boolean, 
/**
 * SDO transfers as one row each.
 */
transfers: boolean, };

/**
 * Something that is wrong.
 */
export type Trouble = { since: number, 
/**
 * Who, if it is one node.
 */
node: number | null, 
/**
 * `node 7 is silent for 2.3 s`.
 */
text: string, 
/**
 * The trace's row from which it follows.
 */
row: number | null, 
/**
 * It was, and is shown until it is acknowledged.
 */
is_over: boolean, };

/**
 * A stop that the drive has not confirmed, and that is sent until it has.
 */
export type Unconfirmed = { since: number, 
/**
 * Why the last attempt has failed; `None` during the first one.
 */
why: string | null, };

/**
 * A value of an entry.
 */
export type Value = { 
/**
 * `6064:00`.
 */
address: string, 
/**
 * With unit, or names; why it could not be read.
 */
text: string, 
/**
 * As a number in its unit, if it is one.
 */
number: number | null, 
/**
 * As it is on the wire, in hexadecimal digits.
 */
raw: string, at: number, is_error: boolean, };

/**
 * The bus as of a moment. Its fields change at different rates: a client is sent those that have changed.
 */
export type View = { time: number, bus: Bus, 
/**
 * The nodes that were heard, found or named; ascending.
 */
nodes: Array<Node>, 
/**
 * The nodes that are drives.
 */
drives: Array<Drive>, devices: Array<Simulated>, 
/**
 * What is under way, and what ended last.
 */
jobs: Array<Job>, 
/**
 * Values that are watched.
 */
watched: Array<Watched>, trace: Trace, control: Control, 
/**
 * The recorded log, if it is one.
 */
log: Log | null, kept: Kept, };

export type Watched = { node: number, 
/**
 * `6064:00`.
 */
address: string, name: string, 
/**
 * How often it is read.
 */
every_ms: number, value: Value | null, seen: Seen | null, 
/**
 * The lowest and the highest number so far.
 */
bounds: [number, number] | null, 
/**
 * How often it has changed.
 */
changes: number, };

export type State = "NOT READY TO SWITCH ON" | "SWITCH ON DISABLED" | "READY TO SWITCH ON" | "SWITCHED ON" | "OPERATION ENABLED" | "QUICK STOP ACTIVE" | "FAULT REACTION ACTIVE" | "FAULT";

export type Verb = "enable" | "disable" | "reset-fault" | "move-to" | "step" | "run" | "home" | "stop" | "quick-stop" | "resume" | "drop";
