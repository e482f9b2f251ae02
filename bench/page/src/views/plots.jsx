// Curves of objects and PDO signals over time.
import { signal } from '@preact/signals'
import { useEffect, useState } from 'preact/hooks'
import { ask, send, sendForFile } from '../bench.js'
import { bounds, columns, crossing, extended, inSight, keyOf, newest, numberAt, thinned } from '../curves.js'
import { NONE, measured, number } from '../format.js'
import { t } from '../i18n/index.js'
import { connection, view } from '../state.js'
import { Age, Button, Choice, Empty, Field, named, Panel, Refusal, isOld, useAsk } from '../ui.jsx'
import { Chart } from './chart.jsx'

/** @import * as wire from '../wire' */

const EVERY = 100 // ms between two requests
const MOST = 100_000 // most points kept of a curve
const DRAWN = 3000 // most points drawn of a curve
const SPANS = [2, 5, 10, 30, 60, 300] // s in sight while following

const curves = signal([])
const hidden = signal(new Set())
/** The time in sight: the last `span` seconds, or `range` while the plot is held. */
const span = signal(10)
const range = signal(null)
const cursors = signal([null, null])
const trigger = signal({ key: '', text: '0', level: 0, rising: true, armed: null })

export function Plots() {
  const [refused, setRefused] = useState(null)
  useEffect(() => {
    if (connection.value !== 'open') return undefined
    let timer
    let isOpen = true
    const look = async () => {
      try {
        await lookForPoints()
        watchTrigger()
        setRefused(null)
      } catch (why) {
        setRefused(why)
      }
      if (isOpen) timer = setTimeout(look, EVERY)
    }
    look()
    return () => {
      isOpen = false
      clearTimeout(timer)
    }
  }, [connection.value])
  const shown = curves.value.filter((curve) => !hidden.value.has(keyOf(curve)))
  const end = newest(curves.value)
  const sight = range.value ?? [Math.max(0, end - span.value), Math.max(end, span.value)]
  const drawn = shown.map((curve) => ({ ...curve, points: thinned(inSight(curve.points, sight), DRAWN) }))
  return (
    <Panel class="fill" title={t('plots.title')} tools={<Tools sight={sight} />}>
      <Add />
      <Refusal of={refused} />
      {curves.value.length === 0 ? (
        <Empty>{t('plots.none')}</Empty>
      ) : (
        <>
          <Chart
            curves={shown}
            colors={colors(curves.value)}
            data={columns(drawn)}
            sight={sight}
            cursors={cursors.value}
            setRange={(next) => (range.value = next)}
            setCursor={setCursor}
          />
          <Trigger />
          <Legend sight={sight} />
        </>
      )}
    </Panel>
  )
}

/** Requests the new points of the curves, or all of them if the set of curves has changed or a log has gone back. */
async function lookForPoints() {
  if (view.time.peek() < newest(curves.peek()) - 1) curves.value = []
  const known = new Set(curves.peek().map(keyOf))
  let news = await ask({ do: 'curves', since: known.size > 0 ? newest(curves.peek()) : -1 })
  if (known.size > 0 && !news.every((curve) => known.has(keyOf(curve)))) news = await ask({ do: 'curves', since: -1 })
  curves.value = extended(curves.peek(), news, MOST)
}

const colors = (curves) => new Map(curves.map((curve, place) => [keyOf(curve), `--curve-${place % 8}`]))

/** Clicks set the first and the second cursor by turns. */
function setCursor(time) {
  const [a, b] = cursors.value
  cursors.value = a === null || b !== null ? [time, null] : [a, time]
}

/** Holds the plot around the first crossing since the trigger was armed. */
function watchTrigger() {
  const { key, level, rising, armed } = trigger.value
  const curve = curves.value.find((each) => keyOf(each) === key)
  if (armed === null || !curve) return
  const at = crossing(curve, level, rising, armed)
  if (at === null || newest(curves.value) < at + span.value * 0.8) return
  range.value = [at - span.value * 0.2, at + span.value * 0.8]
  cursors.value = [at, null]
  trigger.value = { ...trigger.value, armed: null }
}

function Tools({ sight }) {
  return (
    <>
      <Choice
        label={t('plots.span')}
        data-test="plot-span"
        value={span.value}
        options={SPANS.map((each) => [each, `${each} s`])}
        set={(seconds) => {
          span.value = Number(seconds)
          range.value = null
        }}
      />
      <Button
        data-test="plot-follow"
        aria-pressed={range.value === null}
        run={() => (range.value = range.value === null ? sight : null)}
      >
        {t('plots.follow')}
      </Button>
      <Button data-test="plot-csv" run={() => sendForFile({ do: 'export-plot', format: 'csv' })}>
        CSV
      </Button>
      <Button data-test="plot-svg" run={() => sendForFile({ do: 'export-plot', format: 'svg' })}>
        SVG
      </Button>
      <Button data-test="plot-clear" run={() => send({ do: 'clear-plot', node: null })}>
        {t('plots.clear')}
      </Button>
    </>
  )
}

/** Signals that are plotted often. */
const USUAL = ['6064:00', '606C:00', '6077:00', '6041:00', 'tpdo1', 'tpdo2']

function Add() {
  const [node, setNode] = useState(null)
  const [text, setText] = useState('')
  const [every, setEvery] = useState(50)
  const [asked, run] = useAsk()
  const [entries, setEntries] = useState([])
  const id = node ?? view.drives.value[0]?.node ?? view.nodes.value[0]?.id ?? null
  useEffect(() => {
    if (id !== null && connection.value === 'open')
      ask({ do: 'objects', node: id }).then(setEntries, () => setEntries([]))
  }, [id, connection.value])
  const add = async (signals) => {
    if (signals.length > 0 && (await run({ do: 'plot', node: id, signals, every_ms: every }))) setText('')
  }
  const known = USUAL.filter((signal) => signal.startsWith('tpdo') || entries.some((entry) => entry.address === signal))
  return (
    <form
      class="line"
      onSubmit={(event) => {
        event.preventDefault()
        add(text.split(/[\s,]+/).filter(Boolean))
      }}
    >
      <Choice
        label={t('node')}
        data-test="plot-node"
        value={id ?? ''}
        options={named(view.nodes.value)}
        set={(each) => setNode(Number(each))}
      />
      <Field
        class="grow"
        label={t('plots.signals')}
        data-test="plot-signals"
        list="signals"
        value={text}
        placeholder="6064:00, tpdo1"
        spellcheck={false}
        set={setText}
      >
        <datalist id="signals">
          {entries.map((entry) => (
            <option key={entry.address} value={entry.address}>
              {entry.name}
            </option>
          ))}
        </datalist>
      </Field>
      <Choice
        label={t('plots.every')}
        data-test="plot-every"
        value={every}
        options={[10, 20, 50, 100, 500, 1000].map((each) => [each, `${each} ms`])}
        set={(each) => setEvery(Number(each))}
      />
      <Button class="main" data-test="plot-add" type="submit" disabled={text.trim() === ''}>
        {t('plots.add')}
      </Button>
      <div class="chips">
        {known.map((signal) => (
          <Button
            key={signal}
            data-test={`plot-quick-${signal}`}
            title={entries.find((entry) => entry.address === signal)?.name ?? signal}
            run={() => add([signal])}
          >
            {signal.toUpperCase()}
          </Button>
        ))}
      </div>
      <Refusal of={asked.refused} test="plot-refusal" />
    </form>
  )
}

function Trigger() {
  const { key, text, rising, armed } = trigger.value
  const set = (change) => (trigger.value = { ...trigger.value, ...change })
  const isArmed = armed !== null
  const arm = async () => {
    const level = await send({ do: 'number', text })
    if (level === null) return
    range.value = null
    set({ level, armed: newest(curves.value), key: key || keyOf(curves.value[0]) })
  }
  return (
    <div class="line" role="group" aria-label={t('trigger')}>
      <Choice
        label={t('trigger')}
        data-test="trigger-curve"
        value={key || keyOf(curves.value[0])}
        options={curves.value.map((curve) => [keyOf(curve), `${curve.node} · ${curve.name}`])}
        set={(key) => set({ key })}
      />
      <Choice
        label={t('trigger.edge')}
        data-test="trigger-edge"
        value={String(rising)}
        options={[
          ['true', t('trigger.rising')],
          ['false', t('trigger.falling')],
        ]}
        set={(edge) => set({ rising: edge === 'true' })}
      />
      <Field
        label={t('trigger.level')}
        size={8}
        data-test="trigger-level"
        value={text}
        set={(text) => set({ text, armed: null })}
      />
      <Button data-test="trigger-arm" aria-pressed={isArmed} run={() => (isArmed ? set({ armed: null }) : arm())}>
        {t(isArmed ? 'trigger.armed' : 'trigger.arm')}
      </Button>
    </div>
  )
}

function Legend({ sight }) {
  const [a, b] = cursors.value
  const toggle = (key) => {
    const next = new Set(hidden.value)
    if (!next.delete(key)) next.add(key)
    hidden.value = next
  }
  return (
    <div class="scroll low">
      <table class="grid" data-test="plot-legend">
        <thead>
          <tr>
            <th>{t('plots.curve')}</th>
            <th class="number">{t('plots.now')}</th>
            <th class="number">{t('plots.low')}</th>
            <th class="number">{t('plots.high')}</th>
            <th class="number">A {a !== null && `${number(a, 3)} s`}</th>
            <th class="number">B {b !== null && `${number(b, 3)} s`}</th>
            <th class="number">Δ {a !== null && b !== null && `${number(b - a, 3)} s`}</th>
            <th>{t('entry.unit')}</th>
          </tr>
        </thead>
        <tbody>
          {curves.value.map((curve, place) => (
            <LegendRow
              key={keyOf(curve)}
              curve={curve}
              place={place}
              sight={sight}
              isHidden={hidden.value.has(keyOf(curve))}
              toggle={toggle}
            />
          ))}
        </tbody>
      </table>
    </div>
  )
}

/** @param {{ curve: wire.Curve, place: number, sight: [number, number], isHidden: boolean, toggle: (key: string) => void }} props */
function LegendRow({ curve, place, sight, isHidden, toggle }) {
  const [a, b] = cursors.value.map((time) => (time === null ? null : numberAt(curve, time)))
  const [low, high] = bounds(inSight(curve.points, sight)) ?? [null, null]
  return (
    <tr data-test={`curve-${curve.node}-${curve.address}`}>
      <td>
        <label class="check">
          <input type="checkbox" checked={!isHidden} onChange={() => toggle(keyOf(curve))} />
          <i class={`swatch curve-${place % 8}`} /> {curve.node} · {curve.name} <code>{curve.address}</code>
        </label>
      </td>
      <td class={isOld(curve.seen) ? 'number old' : 'number'}>
        {measured(curve.points.at(-1)?.[1])}{' '}
        <Age seen={curve.seen} test={`curve-${curve.node}-${curve.address}-seen`} />
      </td>
      <td class="number">{measured(low)}</td>
      <td class="number">{measured(high)}</td>
      <td class="number">{measured(a)}</td>
      <td class="number">{measured(b)}</td>
      <td class="number">{a !== null && b !== null && measured(b - a)}</td>
      <td>{curve.unit ?? NONE}</td>
    </tr>
  )
}
