// Every frame in words: filtered, followed or held, a million of them scrolled.
import { signal } from '@preact/signals'
import { useEffect, useRef, useState } from 'preact/hooks'
import { ask, orderFile } from '../bench.js'
import { NO_FILTER, SERVICES, asOptions, has, isFiltering, toggled } from '../filters.js'
import { clock, number } from '../format.js'
import { t } from '../i18n/index.js'
import { placeOf, scale, scrollTopOf, topRow, windowOf } from '../scroll.js'
import { connection, view, wantedRow } from '../state.js'
import { Button, Panel, Refusal, useResize } from '../ui.jsx'

const ROW = 21 // px
const MARGIN = 60 // rows asked for beyond those in sight
const FORMATS = ['candump', 'pcap', 'pcapng', 'asc', 'trc', 'blf']

const filter = signal(NO_FILTER)
const isFollowing = signal(true)
const chosenRow = signal(null)

export function Trace() {
  const [format, setFormat] = useState(FORMATS[0])
  const { first, end } = view.trace.value
  return (
    <Panel class="fill" title={t('trace.title')} tools={
      <>
        <span class="figure" data-test="trace-extent">{t('trace.kept', { kept: number(end - first), all: number(end) })}</span>
        <Button data-test="trace-follow" aria-pressed={isFollowing.value} run={() => (isFollowing.value = !isFollowing.value)}>{t(isFollowing.value ? 'trace.hold' : 'trace.follow')}</Button>
        <select aria-label={t('trace.format')} data-test="trace-format" value={format} onChange={(event) => setFormat(event.target.value)}>
          {FORMATS.map((each) => <option key={each}>{each}</option>)}
        </select>
        <Button data-test="trace-export" run={() => orderFile({ do: 'export', format, filter: filter.value })}>{t('export')}</Button>
      </>
    }>
      <Filter />
      <Frames />
    </Panel>
  )
}

function Filter() {
  const set = (change) => (filter.value = { ...filter.value, ...change })
  const text = (key, size) => (
    <label class="field">
      <span>{t(`filter.${key}`)}</span>
      <input data-test={`filter-${key}`} type={key === 'text' ? 'search' : 'text'} size={size} spellcheck={false} value={filter.value[key]} placeholder={t(`filter.${key}.example`)} onInput={(event) => set({ [key]: event.target.value })} />
    </label>
  )
  const check = (key) => (
    <label class="check">
      <input type="checkbox" data-test={`filter-${key}`} checked={filter.value[key]} onChange={(event) => set({ [key]: event.target.checked })} />
      {t(`filter.${key}`)}
    </label>
  )
  return (
    <form class="line filter" role="search" aria-label={t('filter')} onSubmit={(event) => event.preventDefault()}>
      {text('text', 16)}
      {text('nodes', 6)}
      {text('object', 10)}
      {text('ids', 8)}
      {text('without', 12)}
      <div class="choice" role="group" aria-label={t('filter.services')}>
        {SERVICES.map((service) => (
          <Button key={service} data-test={`filter-${service}`} aria-pressed={has(filter.value.services, service)} run={() => set({ services: toggled(filter.value.services, service) })}>{service.toUpperCase()}</Button>
        ))}
      </div>
      {check('alarming')}
      {check('transfers')}
      <Button class="quiet" data-test="filter-clear" disabled={!isFiltering(filter.value)} title={asOptions(filter.value)} run={() => (filter.value = { ...NO_FILTER, transfers: filter.value.transfers })}>{t('filter.clear')}</Button>
    </form>
  )
}

/** Rows of the trace: what was asked for last, and where the window stands. */
function useFrames(visible) {
  const [frames, setFrames] = useState({ matching: 0, from: 0, rows: [] })
  const [refused, setRefused] = useState(null)
  const top = useRef(0)
  const asked = useRef({ isBusy: false, again: false, key: '' })
  const [, draw] = useState(0)

  /** One question at a time; what was wished for meanwhile is asked afterwards. */
  const look = async () => {
    if (asked.current.isBusy) return (asked.current.again = true)
    asked.current = { ...asked.current, isBusy: true, again: false }
    const follow = isFollowing.value
    const wanted = follow ? { from: -(visible + MARGIN), count: visible + MARGIN } : windowOf(top.current, visible, Infinity, MARGIN)
    try {
      const found = await ask({ do: 'trace', filter: filter.value, ...wanted })
      if (follow) top.current = Math.max(0, found.matching - visible + 1)
      else keepPlace(found)
      setFrames(found)
      setRefused(null)
    } catch (why) {
      setRefused(why)
    }
    asked.current.isBusy = false
    if (asked.current.again) look()
  }
  /** When the oldest rows go, the places of the others change: the row in sight stays in sight. */
  const keepPlace = (found) => {
    const before = frames.rows[Math.floor(top.current) - frames.from]
    if (!before) return
    const place = found.rows.findIndex((row) => row.number === before.number)
    const moved = place < 0 ? 0 : Math.floor(top.current) - (found.from + place)
    if (moved > 0) top.current -= moved
  }
  const scrollTo = (row) => {
    top.current = Math.max(0, Math.min(row, Math.max(0, frames.matching - visible + 1)))
    const { from, rows } = frames
    const inSight = top.current >= from && top.current + visible <= from + rows.length
    if (!inSight || top.current - from < MARGIN / 3 || from + rows.length - top.current - visible < MARGIN / 3) look()
    draw((count) => count + 1)
  }
  return { frames, refused, top, look, scrollTo }
}

function Frames() {
  const element = useRef()
  const [size, setSize] = useState(600)
  const visible = Math.ceil(size / ROW)
  const { frames, refused, top, look, scrollTo } = useFrames(visible)
  const bar = scale(frames.matching, ROW, size)
  const { end, first } = view.trace.value

  useResize(element, () => setSize(element.current.clientHeight))
  useEffect(() => {
    look()
  }, [end, first, filter.value, isFollowing.value, size, connection.value])
  useEffect(() => {
    element.current.scrollTop = scrollTopOf(bar, top.current)
  })
  useEffect(() => {
    const wanted = wantedRow.value
    if (!wanted) return
    isFollowing.value = false
    const rowAt = async (from) => (await ask({ do: 'trace', filter: NO_FILTER, from, count: 1 })).rows[0]
    filter.value = NO_FILTER
    ask({ do: 'trace', filter: NO_FILTER, from: 0, count: 1 })
      .then(({ matching }) => placeOf(wanted.number, matching, rowAt))
      .then((place) => {
        chosenRow.value = wanted.number
        top.current = Math.max(0, place - visible / 2)
        look()
      })
      .catch(() => {})
    wantedRow.value = null
  }, [wantedRow.value])

  const hold = () => (isFollowing.value = false)
  const step = (rows) => {
    hold()
    scrollTo(top.current + rows)
  }
  const keys = (event) => {
    const rows = { ArrowDown: 1, ArrowUp: -1, PageDown: visible - 2, PageUp: 2 - visible }[event.key]
    if (rows !== undefined) step(rows)
    else if (event.key === 'Home') step(-Infinity)
    else if (event.key === 'End') isFollowing.value = true
    else if (event.key === ' ') isFollowing.value = !isFollowing.value
    else return
    event.preventDefault()
  }
  const wheel = (event) => {
    if (event.deltaY === 0) return
    event.preventDefault()
    step((event.deltaMode === 1 ? event.deltaY : event.deltaY / ROW))
  }
  // Not through JSX, where a listener would be passive.
  useEffect(() => {
    const target = element.current
    target.addEventListener('wheel', wheel, { passive: false })
    return () => target.removeEventListener('wheel', wheel)
  })
  /** Only the scroll bar comes here with another place than ours. */
  const scrolled = () => {
    if (Math.abs(element.current.scrollTop - scrollTopOf(bar, top.current)) < 2) return
    hold()
    scrollTo(topRow(bar, element.current.scrollTop))
  }
  const shown = frames.rows.slice(Math.max(0, Math.floor(top.current) - frames.from), Math.max(0, Math.ceil(top.current) - frames.from + visible + 1))
  const firstShown = Math.max(frames.from, Math.floor(top.current))
  return (
    <div class="frames">
      <Refusal of={refused} />
      <div class="frame-row head" aria-hidden="true">
        {['number', 'time', 'id', 'service', 'data', 'text'].map((column) => <span key={column}>{t(`trace.${column}`)}</span>)}
      </div>
      <div ref={element} class="frames-window" role="table" aria-label={t('trace.title')} aria-rowcount={frames.matching} tabindex="0" data-test="trace" onKeyDown={keys} onScroll={scrolled}>
        <div class="extent" style={{ height: `${bar.extent}px` }}>
          <div class="sheet" style={{ transform: `translateY(${scrollTopOf(bar, top.current) + (firstShown - top.current) * ROW}px)` }}>
            {shown.map((row) => <FrameRow key={row.number} row={row} />)}
          </div>
        </div>
      </div>
      <p class="hint" role="status">{t(isFollowing.value ? 'trace.following' : 'trace.held', { count: number(frames.matching) })}</p>
    </div>
  )
}

function FrameRow({ row }) {
  return (
    <div role="row" class={`frame-row ${row.alarming ? 'alarming' : ''} ${chosenRow.value === row.number ? 'chosen' : ''}`} data-test={`row-${row.number}`} onClick={() => (chosenRow.value = row.number)}>
      <span role="cell">{row.number}</span>
      <span role="cell">{clock(row.time, 4)}</span>
      <span role="cell">{row.id}</span>
      <span role="cell" class={`service ${row.service.toLowerCase().replace(/\W.*|\d+/g, '')}`}>{row.service}</span>
      <span role="cell">{row.data}</span>
      <span role="cell" title={row.text}>{row.node !== null && <b>{row.node} </b>}{row.text}</span>
    </div>
  )
}
