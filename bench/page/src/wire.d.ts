// Made of the bench's types: LEXICAN_BLESS=1 cargo test -p lexican-bench golden

/**
 * The answer to a request.
 */
export type Answer = "done" | { "objects": Array<Object> } | { "values": Array<Value> } | { "differences": Array<Difference> } | { "pdos": Array<Pdo> } | { "objections": Array<string> } | { "frames": Frames } | { "curves": Array<Curve> } | { "number": number };

export type Bus = { 
/**
 * `can0`, `demo`, `bus.log`.
 */
name: string, is_writable: boolean, 
/**
 * In bit/s; `None` if unknown.
 */
bit_rate: number | null, 
/**
 * The controller's state, `active` or `off`; or why the bus is lost.
 */
state: string, frames: number, 
/**
 * In the last second.
 */
frames_per_second: number, 
/**
 * In the last second; `None` without a bit rate.
 */
load_percent: number | null, 
/**
 * In the second with the most bits.
 */
load_percent_peak: number | null, 
/**
 * Frames lost between the controller and the bench.
 */
missing_frames: number, 
/**
 * The rates by COB-ID.
 */
ids: Array<Rate>, 
/**
 * What is wrong on the bus, which node causes it, and what to do.
 */
troubles: Array<Trouble>, };

/**
 * The content of an answer. A file has to be fetched from its address.
 */
export type Content = { "file": { name: string, url: string, bytes: number, } } | Answer;

/**
 * Which client may change something.
 */
export type Control = { 
/**
 * The number of the client that has control.
 */
holder: number | null, 
/**
 * The number of open clients.
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
 * When its last point was seen.
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
 * The value in the node, as text.
 */
here: string, 
/**
 * The value on the other side, as text.
 */
there: string, };

export type Drive = { node: number, 
/**
 * See [`Node::name`].
 */
name: string, 
/**
 * The state of CiA 402: `OPERATION ENABLED`; `None` if unknown.
 */
state: string | null, 
/**
 * The states to which it may be ordered now.
 */
allowed: Array<string>, 
/**
 * When state, position and velocity were seen: the oldest of them.
 */
seen: Seen | null, 
/**
 * The mode of operation as text.
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
 * The target of the current motion.
 */
target: number | null, 
/**
 * Why an order would be refused now, in sentences; empty if the drive would move. `None` if not checked yet: that
 * is done while a client has control.
 */
obstacles: Array<string> | null, 
/**
 * The current order as text.
 */
order: string | null, 
/**
 * How the last order ended.
 */
ending: Ending | null, 
/**
 * A stop that was ordered, until the drive confirms its standstill.
 */
unconfirmed: Unconfirmed | null, 
/**
 * The orders that this drive supports.
 */
orders: Array<Verb>, 
/**
 * The homing methods that it supports.
 */
homing_methods: Array<number>, };

/**
 * How an order ended.
 */
export type Ending = { is_success: boolean, 
/**
 * Whether the drive may still be moving, because it could not be stopped.
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
 * The meaning of the code: `DC link over-voltage; the brake resistor is too small`.
 */
text: string, row: number, };

/**
 * Rows of the trace that match a filter.
 */
export type Frames = { 
/**
 * The number of matching rows that are kept.
 */
matching: number, 
/**
 * The position of the first of these rows among them.
 */
from: number, rows: Array<Row>, };

/**
 * An input of a simulated device.
 */
export type Input = { 
/**
 * `shaft`.
 */
name: string, 
/**
 * A description in one sentence.
 */
help: string, 
/**
 * The possible values: `free`, `blocked`; empty for a number.
 */
choices: Array<string>, 
/**
 * The present value.
 */
value: string | null, };

/**
 * A long-running job.
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
 * The progress from 0 to 1; `None` if unknown.
 */
done: number | null, 
/**
 * The present step, `6081:00 Profile velocity`; at the end, the result as text.
 */
text: string, 
/**
 * Whether it has succeeded; `None` while it runs.
 */
is_success: boolean | null, };

/**
 * What the file of a machine keeps for the bench, besides watched values.
 */
export type Kept = { 
/**
 * The sequences that the file lists.
 */
sequences: Array<string>, 
/**
 * The messages that the file lists: sequences of one line, after which drives are not stopped.
 */
messages: Array<string>, 
/**
 * The filters of the trace that the file lists, by name.
 */
filters: Array<[string, TraceFilter]>, 
/**
 * While recording: the number of lines so far.
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
 * What is missing or used instead, with the remedy.
 */
text: string, };

export type Log = { seconds: number, 
/**
 * The present position.
 */
position: number, 
/**
 * 0 while paused.
 */
speed: number, };

/**
 * An NMT command (CiA 301, 7.2.8.2).
 */
export type Nmt = "start" | "stop" | "pre-operational" | "reset-node" | "reset-communication";

export type Node = { id: number, 
/**
 * The name in the plant, else 1008h, else that of its data sheet.
 */
name: string, 
/**
 * The name of the data sheet: `siko/ag03-1`.
 */
sheet: string | null, 
/**
 * Whether it stores a data sheet (1021h) that is not used.
 */
stores_sheet: boolean, 
/**
 * 1018h as far as known: vendor-ID, product code, revision number, serial number.
 */
identity: [number | null, number | null, number | null, number | null], 
/**
 * `OPERATIONAL`; `None` if unknown.
 */
state: string | null, 
/**
 * When the state was seen.
 */
seen: Seen | null, 
/**
 * The mean interval of its heartbeats, in ms.
 */
heartbeat_ms: number | null, 
/**
 * How long it has been silent; `None` unless it should have been heard.
 */
silent_seconds: number | null, 
/**
 * The present faults.
 */
faults: Array<Fault>, 
/**
 * Past faults, newest first.
 */
history: Array<Fault>, 
/**
 * The median SDO response time, in ms.
 */
sdo_ms: number | null, aborts: number, boots: number, 
/**
 * What the drive or its data sheet lacks for moving it, and what is used instead.
 */
lacks: Array<Lack>, 
/**
 * Changes since the bench was opened: `the state: PRE-OPERATIONAL, now OPERATIONAL`.
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
 * Its own name, or that of the object for a single value.
 */
name: string, 
/**
 * The area of the dictionary: `Communication`, `Manufacturer`, `Drive`.
 */
group: string, 
/**
 * `UNSIGNED32`.
 */
data_type: string, 
/**
 * The size in a PDO; `None` if it is not fixed.
 */
bits: number | null, 
/**
 * `rw`, `ro`, `wo`, `const`.
 */
access: string, 
/**
 * `tpdo`, `rpdo`, `both`; `None` if it cannot be mapped.
 */
mappable: string | null, 
/**
 * The default as text.
 */
default: string | null, low: string | null, high: string | null, 
/**
 * The names that can be written: of its enumeration or bits.
 */
choices: Array<string>, unit: string | null, 
/**
 * The description from the overlay.
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
 * In ms; `None` if the device lacks it.
 */
event_timer_ms: number | null, 
/**
 * The minimum interval of frames; `None` if the device lacks it.
 */
inhibit_ms: number | null, 
/**
 * The mapped objects, from bit 0 on.
 */
fields: Array<PdoField>, 
/**
 * Frames in the last second.
 */
per_second: number, conflict: string | null, 
/**
 * Entries that may be mapped into it: address and name.
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
 * The last value as text.
 */
text: string | null, 
/**
 * When the value was seen, in seconds as [`View::time`].
 */
at: number | null, };

/**
 * The frames with one COB-ID.
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
 * `None` for broadcasts.
 */
node: number | null, frames: number, 
/**
 * In the last second.
 */
per_second: number, 
/**
 * The standard deviation of the intervals between frames, in ms.
 */
jitter_ms: number | null, 
/**
 * The share of all bits in the last second.
 */
share_percent: number, };

/**
 * Why a request was refused.
 */
export type Refused = { 
/**
 * The reason, with node, index and value.
 */
why: string, 
/**
 * What to do about it.
 */
remedy: string | null, };

/**
 * A request of a client. Requests that change something on the bus need control ([`Request::TakeControl`]), except
 * stops.
 *
 * In JSON: `{"do": "write", "node": 5, "address": "6081:00", "text": "100 rpm"}`.
 */
export type Request = { "do": "take-control", 
/**
 * Take it from the client that has it, and stop what that has started.
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
 * `6064:00`; or `1018` for all entries of an object.
 */
addresses: Array<string>, } | { "do": "seen", node: number, addresses: Array<string>, } | { "do": "write", node: number, address: string, 
/**
 * In the notation of `lexican write`: `100 rpm`, `profile position`, `0x1F`.
 */
text: string, 
/**
 * Write even what the data sheet does not allow.
 */
force: boolean, } | { "do": "watch", node: number, address: string, 
/**
 * The interval, at least 10 ms.
 */
every_ms: number, } | { "do": "unwatch", node: number, address: string, } | { "do": "compare", node: number, with: Other, } | { "do": "backup", node: number, } | { "do": "restore", node: number, dcf: string, } | { "do": "pdos", node: number, } | { "do": "map-pdo", node: number, 
/**
 * `tpdo1`.
 */
pdo: string, objects: Array<string>, 
/**
 * `event`, `sync`, `sync:4`, `every:10ms`; unchanged if `None`.
 */
transmission: string | null, check: boolean, } | { "do": "trace", 
/**
 * In the notation of `lexican monitor`'s options; all frames by default.
 */
filter: TraceFilter, 
/**
 * The first row, counted from the oldest match that is kept; from the end backwards if negative.
 */
from: number, 
/**
 * Count from the first match with this row number or a higher one instead, so that rows stay in place when
 * older ones are dropped.
 */
at?: number | null, 
/**
 * The number of rows, at most 1,000.
 */
count: number, } | { "do": "export", 
/**
 * The name of a log format, as in `lexican convert`.
 */
format: string, filter: TraceFilter, } | { "do": "plot", node: number, 
/**
 * `6064:00`, `tpdo1`.
 */
signals: Array<string>, 
/**
 * The interval of reading objects.
 */
every_ms: number, } | { "do": "clear-plot", 
/**
 * `None` for all.
 */
node: number | null, } | { "do": "curves", 
/**
 * In seconds, as [`View::time`](crate::View::time).
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
 * A position, distance or velocity with or without unit (`90 deg`), or a homing method.
 */
value: string | null, } | { "do": "record", on: boolean, } | { "do": "play-sequence", name: string, 
/**
 * Its lines; `None` for one of [`Kept::sequences`](crate::view::Kept::sequences).
 */
text: string | null, } | { "do": "input", node: number, text: string, } | { "do": "power", node: number, on: boolean, } | { "do": "seek", 
/**
 * In seconds from the first frame.
 */
seconds: number, } | { "do": "play", 
/**
 * 1 for the speed of the recording; 0 pauses.
 */
speed: number, };

/**
 * A frame or an SDO transfer as text.
 */
export type Row = { 
/**
 * The row number, from 0; for a transfer, that of its last frame.
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
 * `None` for broadcasts.
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
 * When something was seen.
 */
export type Seen = { 
/**
 * In seconds, as [`View::time`].
 */
at: number, 
/**
 * Whether it should have been seen again meanwhile, so that its present value is unknown.
 */
is_old: boolean, };

export type Simulated = { node: number, 
/**
 * The name in the plant.
 */
name: string, is_on: boolean, 
/**
 * The inputs that can be set.
 */
inputs: Array<Input>, };

/**
 * A message to a page, other than a view ([`Fields`](super::changes::Fields)).
 */
export type ToPage = { "hello": { client: number, version: string, } } | { id: number, } & ({ "answer": Content } | { "refused": Refused });

/**
 * The range of the trace.
 */
export type Trace = { 
/**
 * The number of the oldest row kept.
 */
first: number, 
/**
 * The number after that of the newest row.
 */
end: number, };

/**
 * Selects frames of the trace, in the notation of `lexican monitor`'s options.
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
 * Whether to select only frames that report an error.
 */
alarming: boolean, 
/**
 * Whether to show SDO transfers as one row each.
 */
transfers: boolean, };

/**
 * Something that is wrong.
 */
export type Trouble = { since: number, 
/**
 * The node that causes it, if it is one.
 */
node: number | null, 
/**
 * `node 7 is silent for 2.3 s`.
 */
text: string, 
/**
 * The row number in the trace that shows it.
 */
row: number | null, 
/**
 * Whether it is past, and shown until it is acknowledged.
 */
is_over: boolean, };

/**
 * A stop that is repeated until the drive confirms its standstill.
 */
export type Unconfirmed = { since: number, 
/**
 * Why the last attempt failed; `None` during the first one.
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
 * With its unit, or as names; or why it could not be read.
 */
text: string, 
/**
 * The number in its unit; `None` if it is none.
 */
number: number | null, 
/**
 * The bytes on the wire, in hexadecimal.
 */
raw: string, at: number, is_error: boolean, };

/**
 * A snapshot of the bus. Clients are sent the fields that have changed.
 */
export type View = { time: number, bus: Bus, 
/**
 * The nodes heard, found or named, ascending.
 */
nodes: Array<Node>, 
/**
 * The nodes that are drives.
 */
drives: Array<Drive>, devices: Array<Simulated>, 
/**
 * Running jobs, and those that ended last.
 */
jobs: Array<Job>, 
/**
 * Watched values.
 */
watched: Array<Watched>, trace: Trace, control: Control, 
/**
 * The recorded log, if the bus is one.
 */
log: Log | null, kept: Kept, };

export type Watched = { node: number, 
/**
 * `6064:00`.
 */
address: string, name: string, 
/**
 * The interval of reading, in ms.
 */
every_ms: number, value: Value | null, seen: Seen | null, 
/**
 * The lowest and the highest number so far.
 */
bounds: [number, number] | null, 
/**
 * The number of changes.
 */
changes: number, };

export type State = "NOT READY TO SWITCH ON" | "SWITCH ON DISABLED" | "READY TO SWITCH ON" | "SWITCHED ON" | "OPERATION ENABLED" | "QUICK STOP ACTIVE" | "FAULT REACTION ACTIVE" | "FAULT";

export type Verb = "enable" | "disable" | "reset-fault" | "move-to" | "step" | "run" | "home" | "stop" | "quick-stop" | "resume" | "drop";
