// The state machine of CiA 402 as a picture: where its states stand, and what leads from one to another.

/** Place and size in the picture's units; the names are those of the bench. */
export const STATES = {
  'NOT READY TO SWITCH ON': [10, 10],
  'SWITCH ON DISABLED': [10, 82],
  'READY TO SWITCH ON': [10, 154],
  'SWITCHED ON': [10, 226],
  'OPERATION ENABLED': [10, 298],
  'QUICK STOP ACTIVE': [250, 298],
  'FAULT REACTION ACTIVE': [250, 10],
  FAULT: [250, 82],
}
export const WIDTH = 190
export const HEIGHT = 44

/** Transitions by their numbers in CiA 402: from, to, and how far beside the straight line. */
export const TRANSITIONS = [
  [1, 'NOT READY TO SWITCH ON', 'SWITCH ON DISABLED', 0],
  [2, 'SWITCH ON DISABLED', 'READY TO SWITCH ON', -40],
  [7, 'READY TO SWITCH ON', 'SWITCH ON DISABLED', 40],
  [3, 'READY TO SWITCH ON', 'SWITCHED ON', -40],
  [6, 'SWITCHED ON', 'READY TO SWITCH ON', 40],
  [4, 'SWITCHED ON', 'OPERATION ENABLED', -40],
  [5, 'OPERATION ENABLED', 'SWITCHED ON', 40],
  [11, 'OPERATION ENABLED', 'QUICK STOP ACTIVE', -10],
  [16, 'QUICK STOP ACTIVE', 'OPERATION ENABLED', 10],
  [12, 'QUICK STOP ACTIVE', 'SWITCH ON DISABLED', 0],
  [14, 'FAULT REACTION ACTIVE', 'FAULT', 0],
  [15, 'FAULT', 'SWITCH ON DISABLED', 0],
]

/** The order that leads to a state; null if a drive goes there by itself or on its way. */
export function orderTo(target, from) {
  if (target === 'OPERATION ENABLED') return 'enable'
  if (target === 'QUICK STOP ACTIVE') return 'quick-stop'
  if (target === 'SWITCH ON DISABLED') return from === 'FAULT' ? 'reset-fault' : 'disable'
  return null
}

/** The line of a transition, from edge to edge: `[x1, y1, x2, y2]`. */
export function line(from, to, beside) {
  const [[x1, y1], [x2, y2]] = [STATES[from], STATES[to]]
  const down = Math.sign(y2 - y1)
  if (x1 === x2) return [x1 + WIDTH / 2 + beside, down > 0 ? y1 + HEIGHT : y1, x2 + WIDTH / 2 + beside, down > 0 ? y2 : y2 + HEIGHT]
  const right = x2 > x1
  const start = [right ? x1 + WIDTH : x1, y1 + HEIGHT / 2 + beside]
  const end = [right ? x2 : x2 + WIDTH, y2 + HEIGHT / 2 + beside]
  return [...start, ...end]
}
