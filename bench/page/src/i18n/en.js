export default {
  yes: 'yes', no: 'no', unknown: 'unknown', loading: 'Reading …', working: 'Working …', close: 'Close', search: 'Search', export: 'Export',
  node: 'Node', tabs: 'Views', jobs: 'Under way', 'per-second': '{count}/s',

  'tab.nodes': 'Nodes', 'tab.objects': 'Objects', 'tab.pdos': 'PDOs', 'tab.trace': 'Trace', 'tab.plots': 'Plots',
  'tab.drives': 'Drives', 'tab.bus': 'Bus', 'tab.devices': 'Simulation', 'tab.badge': '{count} to look at',

  'connection.connecting': 'connecting', 'connection.open': 'connected', 'connection.lost': 'no connection', 'connection.ended': 'ended', 'connection.refused': 'refused',
  faces: '{count} pages open', 'faces.one': 'only this page',
  lost: 'The connection to the bench is lost.', 'lost.what': 'What is shown is old, and nothing can be stopped from here; the bench stops what this page started. The page connects again by itself.',
  ended: 'The bench has ended.', 'ended.what': 'What is shown is old, and nothing can be stopped from here. Start `lexican bench` again, and open the address that it prints.',
  forbidden: 'The bench does not know this page.', 'forbidden.what': 'Open the address that `lexican bench` printed, with its token: each run has its own.',
  'refused.lost': 'The connection to the bench is lost.',

  'hands.mine': 'Hands on', 'hands.free': 'Look only', 'hands.theirs': 'Page {holder} has the hands',
  'hands.take': 'Hands on', 'hands.release': 'Hands off', 'hands.force': 'Take them',
  'hands.force.help': 'Takes the hands from the other page; what it started is stopped',
  'hands.first': 'Take “Hands on” first: one page at a time may change something.',
  'hands.read-only': 'A recorded log, or a bus that is only listened to: nothing can be changed.',
  'hands.lost': 'No connection to the bench.',

  'stop.sent': 'stopping …', 'stop.answered': 'every drive has stopped, after {ms} ms', 'stop.unanswered': 'NOT CONFIRMED YET: if anything moves, use the machine’s emergency stop',
  'stop.refused': 'FAILED: {why}', 'stop.unsent': 'NO CONNECTION: use the machine’s emergency stop',

  'language.switch': 'Deutsch', 'theme.switch': 'Light, dark, or as the system has it',
  'theme.system': 'Auto', 'theme.light': 'Light', 'theme.dark': 'Dark',

  'help.title': 'Keys', 'help.stop': 'STOP stops every drive by its driver. It is no emergency stop: it needs this computer, the bus and the drive.',
  'keys.stop': 'STOP: stops every drive, from anywhere on the page', 'keys.tabs': 'The views, in their order', 'keys.search': 'Search in the view',
  'keys.hands': 'Hands on, hands off', 'keys.help': 'This list', 'keys.rows': 'From row to row, first, last', 'keys.tree': 'Fold and unfold',
  'keys.hold': 'Trace: hold and follow', 'keys.pages': 'Page by page', 'keys.move': 'PDO: move a mapped object',
  'keys.remove': 'PDO: remove a mapped object', 'keys.plot': 'Plot: zoom, pan, follow again',

  log: 'Recorded log', 'log.play': 'Play', 'log.hold': 'Hold', 'log.position': 'Time', 'log.speed': 'Speed',

  'nodes.title': 'Nodes ({count})', 'nodes.none': 'No node was heard yet. “Scan” asks for them.', 'nodes.scan': 'Scan',
  'nmt.all': 'Network management, all nodes', 'nmt.node': 'Network management, node {node}',
  'nmt.start': 'Start', 'nmt.start.help': 'To OPERATIONAL', 'nmt.stop': 'Stop', 'nmt.stop.help': 'To STOPPED',
  'nmt.pre-operational': 'Pre-op', 'nmt.pre-operational.help': 'To PRE-OPERATIONAL',
  'nmt.reset-node': 'Reset', 'nmt.reset-node.help': 'Reset the node', 'nmt.reset-communication': 'Reset comm', 'nmt.reset-communication.help': 'Reset its communication',
  'node.id': 'ID', 'node.name': 'Name', 'node.state': 'State', 'node.faults': 'Faults', 'node.heartbeat': 'Heartbeat', 'node.sdo': 'SDO time',
  'node.aborts': 'Aborts', 'node.sheet': 'Data sheet', 'node.sheet.set': 'Use', 'node.silent': 'silent for {seconds} s',
  'node.vendor': 'Vendor', 'node.product': 'Product', 'node.revision': 'Revision', 'node.serial': 'Serial number', 'node.boots': 'Boot-ups',
  'node.no-faults': 'No fault.', 'node.history': 'Earlier faults', 'node.changes': 'Changed since the bench was opened', 'node.no-changes': 'Nothing.',
  'lss.title': 'LSS', 'lss.help': 'Looks for one device without a node-ID (fastscan), and gives it this one.', 'lss.assign': 'Find and assign', 'lss.taken': 'Node {id} is there already.',

  'objects.title': 'Object dictionary', 'objects.search': 'index, name, group', 'objects.none': 'No object matches.',
  'objects.read-shown': 'Read shown', 'objects.read-shown.help': 'Reads all objects that are listed',
  'entry.title': 'Object', 'entry.none': 'Choose an object.', 'entry.address': 'Index', 'entry.name': 'Name', 'entry.value': 'Value', 'entry.access': 'Access',
  'entry.type': 'Data type', 'entry.default': 'Default', 'entry.limits': 'Limits', 'entry.unit': 'Unit', 'entry.raw': 'On the wire', 'entry.group': 'Group',
  'entry.read': 'Read', 'entry.record': 'Read record', 'entry.record.help': 'Reads all entries of this object', 'entry.watch': 'Watch', 'entry.unwatch': 'Do not watch',
  'entry.plot': 'Plot', 'entry.unread': 'not read yet', 'entry.new': 'New value', 'entry.write': 'Write', 'entry.written': 'Written.', 'entry.use-default': 'Take the default',
  'entry.force': 'Send anyway', 'entry.force.help': 'Sends what the data sheet does not allow; the device may still refuse it',
  'mappable.tpdo': 'mappable into TPDOs', 'mappable.rpdo': 'mappable into RPDOs', 'mappable.both': 'mappable',
  'watch.title': 'Watched values', 'watch.none': 'Nothing is watched.', 'watch.bounds': 'Range', 'watch.changes': 'Changes', 'watch.every': 'read every {ms} ms',
  'parameters.title': 'All parameters', backup: 'Back up', restore: 'Restore', 'restore.help': 'Writes what differs from the DCF', dcf: 'DCF',
  'compare.defaults': 'Compare with defaults', 'compare.node': 'Compare with node', 'compare.dcf': 'Compare', 'compare.same': 'No difference.', 'compare.here': 'In the node', 'compare.there': 'There',

  'pdos.title': 'PDOs', 'pdos.read': 'Read again', 'pdos.none': 'This node has no PDOs.', 'pdos.receive': 'Receive PDOs: to the node', 'pdos.transmit': 'Transmit PDOs: from the node',
  'pdo.on': 'on', 'pdo.off': 'off', 'pdo.timer': 'event timer {ms} ms', 'pdo.inhibit': 'inhibit time {ms} ms', 'pdo.bits': '{used} of {all} bits', 'pdo.edit': 'Change mapping', 'pdo.empty': 'empty',
  'bits.byte': 'byte {byte}', 'bits.bytes': 'bytes {byte}–{last}', 'bits.bit': 'byte {byte}, bit {bit}', 'bits.range': 'byte {byte}, bit {bit} – byte {last}, bit {lastBit}', 'bits.count': '{bits} bits',
  'map.mappable': 'Mappable objects', 'map.add': 'Add', 'map.present': 'Mapped objects', 'map.empty': 'Drag objects here, or add them by Enter.', 'map.help': 'Drag, or Alt+arrow to move, Del to remove.',
  'map.earlier': 'Earlier', 'map.later': 'Later', 'map.remove': 'Remove', 'map.checking': 'Checking …', 'map.fine': 'Nothing speaks against it.', 'map.transmission': 'Transmission', 'map.apply': 'Apply', 'map.revert': 'Revert',

  'trace.title': 'Trace', 'trace.kept': '{kept} kept of {all}', 'trace.follow': 'Follow', 'trace.format': 'Format', 'trace.jump': 'To this frame in the trace',
  'trace.number': 'No.', 'trace.time': 'Time', 'trace.id': 'COB-ID', 'trace.service': 'Service', 'trace.data': 'Data', 'trace.text': 'Meaning',
  'trace.following': 'Following: {count} rows match.', 'trace.held': 'Held: {count} rows match. End or “Follow” goes on.',
  filter: 'Filter', 'filter.text': 'Text', 'filter.nodes': 'Nodes', 'filter.object': 'Object', 'filter.ids': 'COB-IDs', 'filter.without': 'Without', 'filter.services': 'Services',
  'filter.alarming': 'Errors only', 'filter.transfers': 'Fold SDO transfers', 'filter.clear': 'Clear',
  'filter.text.example': '', 'filter.nodes.example': '3,5-9', 'filter.object.example': '6041', 'filter.ids.example': '180-1FF', 'filter.without.example': 'sync,heartbeat',

  'plots.title': 'Plots', 'plots.none': 'No curve yet: choose a node and signals.', 'plots.span': 'In sight', 'plots.follow': 'Follow', 'plots.clear': 'Remove all',
  'plots.signals': 'Objects, PDOs', 'plots.every': 'Every', 'plots.add': 'Add', 'plots.curve': 'Curve', 'plots.now': 'Now', 'plots.low': 'Lowest', 'plots.high': 'Highest', 'plots.increments': 'inc',
  trigger: 'Trigger', 'trigger.edge': 'Edge', 'trigger.rising': 'rising', 'trigger.falling': 'falling', 'trigger.level': 'Level', 'trigger.arm': 'Arm', 'trigger.armed': 'Armed …',

  'drives.none': 'No node is a drive.', 'drive.machine': 'State machine of CiA 402; present state: {state}', 'drive.to-state': 'To {state}',
  'drive.position': 'Position', 'drive.velocity': 'Velocity', 'drive.target': 'Target', 'drive.mode': 'Operating mode', 'drive.ready': 'Ready for orders.', 'drive.obstacles': 'Would refuse, because',
  'drive.value': 'Position, distance or velocity', 'drive.method': 'Homing method', 'drive.may-be-moving': 'It may still be moving: it could not be told to stop.',
  'order.enable': 'Enable', 'order.enable.help': 'To OPERATION ENABLED', 'order.disable': 'Disable', 'order.disable.help': 'To SWITCH ON DISABLED',
  'order.reset-fault': 'Reset fault', 'order.reset-fault.help': 'Leave FAULT', 'order.move-to': 'Move to', 'order.move-to.help': 'Travel to the position',
  'order.step': 'Step', 'order.step.help': 'Travel by the distance', 'order.run': 'Run', 'order.run.help': 'Run at the velocity until it is stopped',
  'order.home': 'Home', 'order.home.help': 'Look for the reference', 'order.stop': 'Stop', 'order.stop.help': 'With the programmed deceleration', 'order.quick-stop': 'Quick stop', 'order.quick-stop.help': 'With full deceleration',

  'bus.title': 'Bus', 'bus.load': 'Bus load', 'bus.state': 'State', 'bus.bit-rate': 'Bit rate', 'bus.peak': 'Peak load', 'bus.rate': 'Frames', 'bus.frames': 'Frames in all', 'bus.missing': 'Lost frames',
  'bus.writable': 'Can be sent to', 'bus.troubles': 'What is wrong', 'bus.no-troubles': 'Nothing is wrong.', 'bus.sdo': 'SDO response times', 'bus.aborts': '{count} aborts', 'bus.ids': 'COB-IDs ({count})',
  'ids.id': 'COB-ID', 'ids.name': 'Service', 'ids.node': 'Node', 'ids.per_second': 'Per second', 'ids.share_percent': 'Share of bus', 'ids.jitter_ms': 'Jitter', 'ids.frames': 'Frames',

  'devices.none': 'There are no simulated devices here: `lexican bench --demo` has some.', 'device.on': 'powered', 'device.off': 'without power', 'device.cut': 'Cut power', 'device.supply': 'Switch on', 'device.set': 'Set', 'device.no-inputs': 'It has no inputs.',
}
