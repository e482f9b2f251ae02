// The state machine of CiA 402 as a picture: the positions of its states, and the transitions between them.

/** @import { State, Verb } from './wire' */

export const PICTURE = { width: 312, height: 330 }
export const BOX = { width: 136, height: 42 }
const [LEFT, RIGHT] = [2, 174]

/**
 * The upper left corner of each state.
 * @type {Record<State, [number, number]>}
 */
export const STATES = {
  'NOT READY TO SWITCH ON': [LEFT, 2],
  'SWITCH ON DISABLED': [LEFT, 72],
  'READY TO SWITCH ON': [LEFT, 142],
  'SWITCHED ON': [LEFT, 212],
  'OPERATION ENABLED': [LEFT, 282],
  'QUICK STOP ACTIVE': [RIGHT, 282],
  'FAULT REACTION ACTIVE': [RIGHT, 2],
  FAULT: [RIGHT, 72],
}

/** The transitions to draw, by their numbers in CiA 402, with the offset of their lines from the middle. */
export const PLACES = { 1: 0, 2: -28, 7: 28, 3: -28, 6: 28, 4: -28, 5: 28, 11: -8, 16: 10, 12: 0, 14: 0, 15: -8 }

/** @type {State[]} */
const OFF = ['SWITCH ON DISABLED', 'READY TO SWITCH ON', 'SWITCHED ON']
/** @type {State[]} */
const ON = ['READY TO SWITCH ON', 'SWITCHED ON', 'OPERATION ENABLED', 'QUICK STOP ACTIVE']

/**
 * The order by which the drive's driver gets from a state to another one; null if there is none.
 * @param {State} target
 * @param {State | null} from
 * @returns {Verb | null}
 */
export function orderTo(target, from) {
  if (target === 'OPERATION ENABLED') return OFF.includes(from) ? 'enable' : null
  if (target === 'QUICK STOP ACTIVE') return from === 'OPERATION ENABLED' ? 'quick-stop' : null
  if (target !== 'SWITCH ON DISABLED') return null
  if (from === 'FAULT') return 'reset-fault'
  return ON.includes(from) ? 'disable' : null
}

/** A name, broken into two lines of about the same length if it is too long for one. */
export function lines(name) {
  if (name.length <= 14) return [name]
  const words = name.split(' ')
  const splits = words.slice(1).map((_, at) => [words.slice(0, at + 1).join(' '), words.slice(at + 1).join(' ')])
  const longer = (split) => Math.max(...split.map((line) => line.length))
  return splits.reduce((best, split) => (longer(split) < longer(best) ? split : best))
}

/** Line and number of a transition: from edge to edge within a column of states, else from side to side. */
export function arrow(from, to, beside) {
  const [[x1, y1], [x2, y2]] = [STATES[from], STATES[to]]
  if (x1 === x2) {
    const x = x1 + BOX.width / 2 + beside
    const [start, end] = y2 > y1 ? [y1 + BOX.height, y2] : [y1, y2 + BOX.height]
    return { line: [x, start, x, end], label: [x + 5, (start + end) / 2 + 3] }
  }
  // An upward line leaves from the top edge, which has room.
  if (y2 < y1) {
    const [x, end] = [x1 + 24, y2 + BOX.height - 10]
    return { line: [x, y1, x2 + BOX.width, end], label: [(x + x2 + BOX.width) / 2 + 6, (y1 + end) / 2 + 4] }
  }
  const [start, end] = x2 > x1 ? [x1 + BOX.width, x2] : [x1, x2 + BOX.width]
  const y = y1 + BOX.height / 2 + beside
  return { line: [start, y, end, y], label: [(start + end) / 2 - 6, y + (beside > 0 ? 12 : -4)] }
}
