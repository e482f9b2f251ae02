// Every frame in words: filtered, followed or held, in a list of up to a million rows.
import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks'
import { ask, sendForFile } from '../bench.js'
import { SERVICES, asOptions, has, isFiltering, toggled } from '../filters.js'
import { clock, number } from '../format.js'
import { language, t } from '../i18n/index.js'
import { scale, scrollTopOf, topRow } from '../scroll.js'
import { connection, view, wantedRow } from '../state.js'
import { TraceWindow } from '../trace-window.js'
import { Button, Field, Panel, Refusal, useResize } from '../ui.jsx'
import { FORMATS, NO_FILTER, TRACE_COLUMNS } from '../words.js'

/** @import { Row, TraceFilter } from '../wire' */

const ROW = 21 // px
const EVERY = 500 // ms between two requests when nothing else causes one

const PATIENCE = 250 // ms from the last key until the filter is applied
/** The filter's text fields, and their widths in characters. */
const FIELDS = { text: 16, nodes: 6, object: 10, ids: 8, without: 12 }
const COLUMNS = TRACE_COLUMNS.filter(({ page }) => page !== null)
const GRID = COLUMNS.map(({ page }) => page).join(' ')

/** Cells that are not just the field of the row. */
const CELLS = {
  time: (row) => clock(row.time, 4),
  text: (row) => (
    <>
      {row.node !== null && <b>{row.node} </b>}
      {row.text}
    </>
  ),
}

/** Global, so that it keeps its position while another tab is open. */
const trace = new TraceWindow(ask)
const toggleFollowing = () => (trace.isFollowing.value ? trace.hold() : trace.follow())

export function Trace() {
  const [format, setFormat] = useState(FORMATS[0])
  const { first, end } = view.trace.value
  return (
    <Panel
      class="fill"
      title={t('trace.title')}
      tools={
        <>
          <span class="figure" data-test="trace-extent">
            {t('trace.kept', { kept: number(end - first), all: number(end) })}
          </span>
          <Button data-test="trace-follow" aria-pressed={trace.isFollowing.value} run={toggleFollowing}>
            {t('trace.follow')}
          </Button>
          <select
            aria-label={t('trace.format')}
            data-test="trace-format"
            value={format}
            onChange={(event) => setFormat(event.currentTarget.value)}
          >
            {FORMATS.map((each) => (
              <option key={each}>{each}</option>
            ))}
          </select>
          <Button
            data-test="trace-export"
            run={() => sendForFile({ do: 'export', format, filter: trace.filter.value })}
          >
            {t('export')}
          </Button>
        </>
      }
    >
      <Filter />
      <Frames />
    </Panel>
  )
}

function Filter() {
  const filter = trace.filter.value
  const set = (change) => trace.setFilter({ ...trace.filter.peek(), ...change })
  const check = (key) => (
    <label class="check">
      <input
        type="checkbox"
        data-test={`filter-${key}`}
        checked={filter[key]}
        onChange={(event) => set({ [key]: event.currentTarget.checked })}
      />
      {t(`filter.${key}`)}
    </label>
  )
  return (
    <form class="line filter" role="search" aria-label={t('filter')} onSubmit={(event) => event.preventDefault()}>
      {Object.entries(FIELDS).map(([key, size]) => (
        <FilterField key={key} name={key} size={size} value={filter[key]} set={set} />
      ))}
      <div class="choice" role="group" aria-label={t('filter.services')}>
        {SERVICES.map((service) => (
          <Button
            key={service}
            data-test={`filter-${service}`}
            aria-pressed={has(filter.services, service)}
            run={() => set({ services: toggled(filter.services, service) })}
          >
            {service.toUpperCase()}
          </Button>
        ))}
      </div>
      {view.kept.value.filters.map(([name, kept]) => (
        <Button key={name} data-test={`filter-kept-${name}`} title={asOptions(kept)} run={() => trace.setFilter(kept)}>
          {name}
        </Button>
      ))}
      {check('alarming')}
      {check('transfers')}
      <Button
        class="quiet"
        data-test="filter-clear"
        disabled={!isFiltering(filter)}
        title={asOptions(filter)}
        run={() => trace.setFilter({ ...NO_FILTER, transfers: filter.transfers })}
      >
        {t('filter.clear')}
      </Button>
    </form>
  )
}

/**
 * Text becomes the filter after a pause in typing, because for each filter the bench goes through all rows.
 * @param {{ name: string, size: number, value: string, set: (change: Partial<TraceFilter>) => void }} props
 */
function FilterField({ name, size, value, set }) {
  const [typed, setTyped] = useState(null)
  useEffect(() => {
    if (typed === null) return
    const timer = setTimeout(() => {
      set({ [name]: typed })
      setTyped(null)
    }, PATIENCE)
    return () => clearTimeout(timer)
  }, [typed])
  return (
    <Field
      label={t(`filter.${name}`)}
      data-test={`filter-${name}`}
      type={name === 'text' ? 'search' : 'text'}
      size={size}
      spellcheck={false}
      value={typed ?? value}
      placeholder={t(`filter.${name}.example`)}
      set={setTyped}
    />
  )
}

function Frames() {
  const element = useRef(null)
  const placed = useRef({ wanted: 0, is: 0 })
  const [size, setSize] = useState(600)
  const { top, frames } = trace
  const bar = scale(frames.value.matching, ROW, size)
  const { first, rows } = trace.shown
  const { end } = view.trace.value

  useResize(element, () => setSize(element.current.clientHeight))
  useEffect(() => trace.resize(Math.ceil(size / ROW)), [size])
  useEffect(() => {
    trace.look()
  }, [end, connection.value])
  useEffect(() => {
    // The bench needs several requests to apply a new filter.
    const timer = setInterval(() => trace.look(), EVERY)
    return () => clearInterval(timer)
  }, [])
  useEffect(() => {
    if (wantedRow.value === null) return
    trace.jumpTo(wantedRow.value)
    wantedRow.value = null
  }, [wantedRow.value])
  useLayoutEffect(() => {
    const wanted = scrollTopOf(bar, top.value)
    if (!element.current || wanted === placed.current.wanted) return // Leave the bar to a user who moves it.
    element.current.scrollTop = wanted
    placed.current = { wanted, is: element.current.scrollTop }
  })

  /** Handles the user's moves of the scroll bar, not those made above. */
  const scrolled = () => {
    if (!element.current) return
    if (Math.abs(element.current.scrollTop - placed.current.is) >= 1)
      trace.scrollTo(topRow(bar, element.current.scrollTop))
  }
  const keys = (event) => {
    const page = trace.visible - 2
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity }[event.key]
    if (step) trace.scrollBy(step)
    else if (event.key === 'End') trace.follow()
    else if (event.key === ' ') toggleFollowing()
    else return
    event.preventDefault()
  }
  useEffect(() => {
    const target = element.current
    const wheel = (event) => {
      if (event.deltaY === 0) return
      event.preventDefault()
      trace.scrollBy(event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY : event.deltaY / ROW)
    }
    // Not passive, as it would be through JSX, because the wheel scrolls by rows.
    target.addEventListener('wheel', wheel, { passive: false })
    return () => target.removeEventListener('wheel', wheel)
  }, [])
  return (
    <div class="frames" style={{ '--columns': GRID }}>
      <Refusal of={trace.refused.value} test="trace-refusal" />
      <div class="frame-row head" aria-hidden="true">
        {COLUMNS.map(({ name, titles }) => (
          <span key={name}>{language.value === 'de' ? titles[1] : titles[0]}</span>
        ))}
      </div>
      <div
        ref={element}
        class="frames-window"
        role="table"
        aria-label={t('trace.title')}
        aria-rowcount={frames.value.matching}
        tabindex={0}
        data-test="trace"
        onKeyDown={keys}
        onScroll={scrolled}
      >
        <div class="extent" style={{ height: `${bar.extent}px` }}>
          <div class="sheet" style={{ transform: `translateY(${(first - top.value) * ROW}px)` }}>
            {rows.map((row, at) => (
              <FrameRow key={row.number} row={row} place={first + at} />
            ))}
          </div>
        </div>
      </div>
      <p class="hint" role="status" data-test="trace-status">
        {t(trace.isFollowing.value ? 'trace.following' : 'trace.held', { count: number(frames.value.matching) })}
      </p>
    </div>
  )
}

/** The service without its number, as a class for its colour: `tpdo`. */
const kindOf = (row) => `service ${row.service.toLowerCase().replace(/\W.*|\d+/g, '')}`

/** @param {{ row: Row, place: number }} props */
function FrameRow({ row, place }) {
  return (
    <div
      role="row"
      aria-rowindex={place + 1}
      class={`frame-row ${row.alarming ? 'alarming' : ''} ${trace.chosen.value === row.number ? 'chosen' : ''}`}
      data-test={`row-${row.number}`}
      onClick={() => (trace.chosen.value = row.number)}
    >
      {COLUMNS.map(({ name }) => (
        <span
          key={name}
          role="cell"
          class={name === 'service' ? kindOf(row) : ''}
          title={name === 'text' ? row.text : null}
        >
          {CELLS[name]?.(row) ?? row[name]}
        </span>
      ))}
    </div>
  )
}
