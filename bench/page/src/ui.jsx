// Small parts that all views share.
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks'
import { send, useAsk } from './bench.js'
import { number } from './format.js'
import { t } from './i18n/index.js'
import { chosenNode, connection, goToRow, nodeId, view, whyNot } from './state.js'

/**
 * @import { ComponentChildren, VNode } from 'preact'
 * @import { Refused, Request, Seen } from './wire'
 */

/**
 * @typedef {{ run?: () => unknown, children?: ComponentChildren, title?: string, [rest: string]: unknown }} ButtonProps
 */

/**
 * Why a request was not carried out, and what to do.
 * @param {{ of: Refused | null, test?: string }} props
 */
export function Refusal({ of, test }) {
  if (!of || (of.why === 'lost' && connection.value !== 'open')) return null // The page itself says so.
  return (
    <p class="refusal" role="alert" data-test={test}>
      <strong>{of.why === 'lost' ? t('refused.lost') : of.why}</strong>
      {of.remedy && <span>{of.remedy}</span>}
    </p>
  )
}

/**
 * A button that changes something on the bus. It needs control; without it, it is disabled and says why.
 * @param {ButtonProps & { disabled?: boolean }} props
 */
export function Act({ run, disabled, children, title, ...rest }) {
  const why = whyNot.value
  const isOff = disabled || why !== null
  return (
    <button type="button" {...rest} aria-disabled={isOff} title={why ? t(why) : title} onClick={() => !isOff && run()}>
      {children}
    </button>
  )
}

/**
 * A button that needs no control.
 * @param {ButtonProps} props
 */
export function Button({ run, children, ...rest }) {
  return (
    <button type="button" {...rest} onClick={run}>
      {children}
    </button>
  )
}

/** Why nothing can be changed now, for a place beside disabled controls. */
export function ControlHint() {
  return whyNot.value && <p class="hint">{t(whyNot.value)}</p>
}

/**
 * A link to the row of the trace from which something was derived.
 * @param {{ row: number | null, test?: string }} props
 */
export function RowLink({ row, test }) {
  if (row === null || row === undefined) return null
  return (
    <button type="button" class="link" data-test={test} title={t('trace.jump')} onClick={() => goToRow(row)}>
      #{number(row)}
    </button>
  )
}

/** @param {{ title: string, tools?: ComponentChildren, children?: ComponentChildren, class?: string, [rest: string]: unknown }} props */
export function Panel({ title, tools, children, class: name = '', ...rest }) {
  return (
    <section class={`panel ${name}`} aria-label={title} {...rest}>
      <header>
        <h2>{title}</h2>
        <div class="tools">{tools}</div>
      </header>
      {children}
    </section>
  )
}

/**
 * A bar from 0 to 100 percent.
 * @param {{ percent: number | null, label: string, alarm?: number }} props
 */
export function Meter({ percent, label, alarm = 80 }) {
  const width = Math.max(0, Math.min(100, percent ?? 0))
  return (
    <span
      class={`meter ${width >= alarm ? 'alarm' : ''}`}
      role="meter"
      aria-label={label}
      aria-valuenow={Math.round(width)}
      aria-valuemin={0}
      aria-valuemax={100}
    >
      <span style={{ width: `${width}%` }} />
    </span>
  )
}

/**
 * Whether it should have been seen again since then, so that its present value is unknown.
 * @param {Seen | null} seen
 */
export const isOld = (seen) => seen?.is_old === true

/**
 * The time when it was last seen, if it should have been seen since then.
 * @param {{ seen: Seen | null, test?: string }} props
 */
export function Age({ seen, test }) {
  if (!isOld(seen)) return null
  return (
    <span class="age" data-test={test}>
      {t('seen.ago', { seconds: number(view.time.value - seen.at, 1) })}
    </span>
  )
}

/**
 * An NMT state, as a mark with a word.
 * @param {{ state: string | null, seen: Seen | null, [rest: string]: unknown }} props
 */
export function State({ state, seen, ...rest }) {
  const kind = { OPERATIONAL: 'good', 'PRE-OPERATIONAL': 'warn', STOPPED: 'bad' }[state] ?? 'none'
  return (
    <>
      <span class={`state ${isOld(seen) ? 'old' : kind}`} {...rest}>
        {state ?? t('unknown')}
      </span>{' '}
      <Age seen={seen} />
    </>
  )
}

/**
 * An input with its name.
 * @param {{ label: string, set: (text: string) => void, class?: string, children?: ComponentChildren, [rest: string]: unknown }} props
 */
export function Field({ label, set, class: name = '', children, ...rest }) {
  return (
    <label class={`field ${name}`}>
      <span>{label}</span>
      <input {...rest} onInput={(event) => set(event.currentTarget.value)} />
      {children}
    </label>
  )
}

/**
 * A choice with its label, among values and their texts.
 * @param {{ label: string, options: [string | number, string | number][], set: (value: string) => void, [rest: string]: unknown }} props
 */
export function Choice({ label, options, set, ...rest }) {
  return (
    <label class="field">
      <span>{label}</span>
      <select {...rest} onChange={(event) => set(event.currentTarget.value)}>
        {options.map(([value, text]) => (
          <option key={value} value={value}>
            {text}
          </option>
        ))}
      </select>
    </label>
  )
}

/**
 * Nodes as options.
 * @param {{ id: number, name: string }[]} nodes
 * @returns {[number, string][]}
 */
export const named = (nodes) => nodes.map(({ id, name }) => [id, `${id} · ${name}`])

/** Chooses the node of a view. */
export function NodePicker() {
  return (
    <Choice
      label={t('node')}
      data-test="pick-node"
      value={nodeId.value ?? ''}
      options={named(view.nodes.value)}
      set={(id) => (chosenNode.value = Number(id))}
    />
  )
}

export function Empty({ children }) {
  return <p class="empty">{children}</p>
}

/**
 * A modal dialog; `open` shows it.
 * @param {{ open: boolean, close: () => void, title: string, children?: ComponentChildren, [rest: string]: unknown }} props
 */
export function Dialog({ open, close, title, children, ...rest }) {
  const element = useRef(null)
  useEffect(() => {
    if (open) element.current.showModal()
    else element.current.close()
  }, [open])
  return (
    <dialog ref={element} onClose={close} aria-label={title} {...rest}>
      <header>
        <h2>{title}</h2>
        <Button class="quiet" run={close}>
          {t('close')}
        </Button>
      </header>
      {open && children}
    </dialog>
  )
}

/** Arrow keys move within a group of buttons, so that Tab leaves the group (roving tabindex of the ARIA practices). */
export function roving(event) {
  const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key]
  const jump = { Home: 0, End: -1 }[event.key]
  if (step === undefined && jump === undefined) return
  const all = [...event.currentTarget.querySelectorAll('[data-roving]')]
  const next =
    jump !== undefined ? all.at(jump) : all[(all.indexOf(document.activeElement) + step + all.length) % all.length]
  event.preventDefault()
  next?.focus()
}

/** Calls `run` at first, and whenever the size of an element has changed. */
export function useResize(element, run) {
  const latest = useRef(null)
  latest.current = run
  // As a layout effect, it is cleaned up before the observer can report an element that is gone.
  useLayoutEffect(() => {
    const watch = new ResizeObserver(() => latest.current())
    watch.observe(element.current)
    return () => watch.disconnect()
  }, [])
}

/**
 * Rows of equal height, of which only those in sight are rendered. `toRow` scrolls one into sight.
 * @param {{ count: number, height: number, row: (at: number, style: object) => VNode, toRow?: number | null, [rest: string]: unknown }} props
 */
export function Rows({ count, height, row, toRow, ...rest }) {
  const [range, setRange] = useState([0, 60])
  const element = useRef(null)
  const look = () => {
    const { scrollTop, clientHeight } = element.current
    const first = Math.max(0, Math.floor(scrollTop / height) - 8)
    const end = Math.ceil((scrollTop + clientHeight) / height) + 8
    if (first !== range[0] || end !== range[1]) setRange([first, end])
  }
  useResize(element, look)
  useEffect(() => {
    if (toRow === null || toRow === undefined || toRow < 0) return
    const { scrollTop, clientHeight } = element.current
    if (toRow * height < scrollTop) element.current.scrollTop = toRow * height
    else if ((toRow + 1) * height > scrollTop + clientHeight)
      element.current.scrollTop = (toRow + 1) * height - clientHeight
  }, [toRow])
  const shown = []
  for (let at = range[0]; at < Math.min(count, range[1]); at++)
    shown.push(row(at, { top: `${at * height}px`, height: `${height}px` }))
  return (
    <div ref={element} class="rows" onScroll={look} {...rest}>
      <div class="extent" style={{ height: `${count * height}px` }}>
        {shown}
      </div>
    </div>
  )
}

/**
 * A button that sends a request; the footer shows a refusal.
 * @param {Omit<Parameters<typeof Act>[0], 'run'> & { request: Request }} props
 */
export function RequestButton({ request, ...rest }) {
  return <Act run={() => send(request)} {...rest} />
}

export { useAsk }
