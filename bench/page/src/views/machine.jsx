// The state machine of a drive as a picture: its state, and the states that can be reached or ordered.
import { t } from '../i18n/index.js'
import { BOX, PICTURE, PLACES, STATES, arrow, lines, orderTo } from '../machine.js'
import { TRANSITIONS } from '../words.js'
import { whyNot } from '../state.js'
import { isOld } from '../ui.jsx'

/**
 * @import { SVGAttributes } from 'preact'
 * @import { Drive, State } from '../wire'
 * @import { Give } from './drives.jsx'
 */

/** The kind of mark for a state. */
export const kindOf = (state) =>
  ({ 'OPERATION ENABLED': 'good', FAULT: 'bad', 'FAULT REACTION ACTIVE': 'bad', 'QUICK STOP ACTIVE': 'warn' })[state] ??
  'none'

/** @param {{ drive: Drive, give: Give }} props */
export function Machine({ drive, give }) {
  const state = drive.state ?? t('unknown')
  return (
    <svg
      class="machine"
      viewBox={`0 0 ${PICTURE.width} ${PICTURE.height}`}
      role="group"
      aria-label={t('drive.machine', { state })}
    >
      <defs>
        <marker
          id={`arrow-${drive.node}`}
          viewBox="0 0 8 8"
          refX="8"
          refY="4"
          markerWidth="7"
          markerHeight="7"
          markerUnits="userSpaceOnUse"
          orient="auto"
        >
          <path d="M0 0L8 4L0 8z" fill="context-stroke" />
        </marker>
      </defs>
      {TRANSITIONS.filter(([number]) => number in PLACES).map((transition) => (
        <Transition key={transition[0]} drive={drive} transition={transition} />
      ))}
      {Object.entries(STATES).map(([name, corner]) => (
        <MachineState key={name} drive={drive} name={/** @type {State} */ (name)} corner={corner} give={give} />
      ))}
    </svg>
  )
}

/** @param {{ drive: Drive, transition: [number, State, State] }} props */
function Transition({ drive, transition: [number, from, to] }) {
  const {
    line: [x1, y1, x2, y2],
    label: [x, y],
  } = arrow(from, to, PLACES[number])
  const isNext = drive.state === from && drive.allowed.includes(to)
  return (
    <g class={isNext ? 'transition next' : 'transition'}>
      <line x1={x1} y1={y1} x2={x2} y2={y2} marker-end={`url(#arrow-${drive.node})`} />
      <text x={x} y={y}>
        {number}
      </text>
    </g>
  )
}

/**
 * A state that can be ordered is a button.
 * @param {{ drive: Drive, name: State, corner: number[], give: Give }} props
 */
function MachineState({ drive, name, corner: [x, y], give }) {
  const isHere = drive.state === name
  const isAllowed = drive.allowed.includes(name)
  const wanted = orderTo(name, /** @type {State | null} */ (drive.state))
  const orderName = drive.orders.includes(wanted) ? wanted : null
  const press = () => whyNot.value === null && give(orderName)
  /** @type {SVGAttributes<SVGGElement> | null} */
  const button = orderName && {
    role: 'button',
    tabindex: 0,
    'aria-label': t('drive.to-state', { state: name }),
    'aria-disabled': whyNot.value !== null,
    onClick: press,
    onKeyDown: (event) => event.key === 'Enter' && press(),
  }
  const text = lines(name)
  return (
    <g
      class={`machine-state ${isHere ? `here ${isOld(drive.seen) ? 'old' : kindOf(name)}` : ''} ${isAllowed ? 'allowed' : ''}`}
      aria-current={isHere || undefined}
      {...button}
    >
      <rect x={x} y={y} width={BOX.width} height={BOX.height} rx="6" />
      {text.map((words, at) => (
        <text
          key={words}
          x={x + BOX.width / 2}
          y={y + BOX.height / 2 + 4 + (at - (text.length - 1) / 2) * 13}
        >{`${words} `}</text>
      ))}
    </g>
  )
}
