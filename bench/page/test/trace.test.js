import assert from 'node:assert/strict'
import { test } from 'node:test'
import { asOptions, has, isFiltering, toggled } from '../src/filters.js'
import { NO_FILTER } from '../src/words.js'
import { placeOf, scale, scrollTopOf, topRow, windowOf } from '../src/scroll.js'
import { TraceWindow } from '../src/trace-window.js'

test('services are put into a filter and taken out of it', () => {
  assert.equal(toggled('', 'sdo'), 'sdo')
  assert.equal(toggled('sdo, emcy', 'sdo'), 'emcy')
  assert.ok(has('sdo, emcy', 'emcy') && !has('sdo', 'do'))
  assert.ok(!isFiltering({ ...NO_FILTER, transfers: false }))
  assert.ok(isFiltering({ ...NO_FILTER, alarming: true }))
  assert.equal(asOptions({ ...NO_FILTER, nodes: '3,5-9', alarming: true }), 'nodes=3,5-9  alarming')
})

test('a scroll bar reaches every row, also of ten millions', () => {
  for (const count of [10, 100, 1_000_000, 10_000_000]) {
    const bar = scale(count, 21, 630)
    assert.ok(bar.extent <= 8_000_000)
    const bottom = topRow(bar, bar.extent - 630)
    assert.ok(count <= 30 ? bottom === 0 : Math.abs(bottom - (count - 30)) < 1e-6, `${count}: ${bottom}`)
    assert.ok(Math.abs(topRow(bar, scrollTopOf(bar, bar.rows / 3)) - bar.rows / 3) < 1e-6)
  }
})

test('rows are asked for around those in sight, a thousand at most', () => {
  assert.deepEqual(windowOf(500.5, 30, 80), { from: 420, count: 191 })
  assert.deepEqual(windowOf(3, 30, 80), { from: 0, count: 113 })
  assert.equal(windowOf(5000, 2000, 80).count, 1000)
})

test('a row is found by its number with few questions', async () => {
  let asked = 0
  const rowAt = async (place) => (asked++, { number: place * 3 })
  assert.equal(await placeOf(300_000, 1_000_000, rowAt), 100_000)
  assert.equal(await placeOf(300_001, 1_000_000, rowAt), 100_001)
  assert.equal(await placeOf(1e9, 10, rowAt), 10)
  assert.ok(asked < 50, `${asked}`)
})

/** A bench with rows of the numbers `first` to `end`, as long as they are kept. */
function bench(first, end) {
  const trace = { first, end, asked: [] }
  trace.ask = async ({ from, count, filter }) => {
    trace.asked.push({ from, count })
    const step = filter.text === 'tenth' ? 10 : 1
    const numbers = []
    for (let number = trace.first; number < trace.end; number++) if (number % step === 0) numbers.push({ number })
    const start = from < 0 ? Math.max(0, numbers.length + from) : from
    return { matching: numbers.length, from: start, rows: numbers.slice(start, start + count) }
  }
  return trace
}
const shown = (window) => window.shown.rows.map(({ number }) => number)

test('following shows the newest rows', async () => {
  const trace = bench(0, 1000)
  const window = new TraceWindow(trace.ask)
  await window.look()
  assert.equal(shown(window).at(-1), 999)
  trace.end = 1500
  await window.look()
  assert.equal(shown(window).at(-1), 1499)
})

test('what is held stays in sight while the oldest rows go', async () => {
  const trace = bench(0, 1000)
  const window = new TraceWindow(trace.ask)
  await window.look()
  window.scrollTo(300)
  await window.look()
  assert.equal(shown(window)[0], 300)
  Object.assign(trace, { first: 50, end: 1050 })
  await window.look()
  assert.equal(shown(window)[0], 300)
})

test('small steps ask for nothing', async () => {
  const trace = bench(0, 1000)
  const window = new TraceWindow(trace.ask)
  window.scrollTo(0)
  await window.look()
  const before = trace.asked.length
  window.scrollBy(3)
  assert.equal(trace.asked.length, before)
})

test('a row is brought into sight, and stays there under another filter', async () => {
  const trace = bench(100, 5000)
  const window = new TraceWindow(trace.ask)
  await window.look()
  await window.jumpTo(2505)
  await window.look()
  assert.ok(shown(window).includes(2505))
  const first = shown(window)[0]
  await window.setFilter({ ...NO_FILTER, text: 'tenth' })
  await window.look()
  assert.equal(shown(window)[0], Math.ceil(first / 10) * 10)
})

test('what a new filter has found so far is in sight while the bench looks on', async () => {
  const trace = bench(0, 5000)
  const window = new TraceWindow(trace.ask)
  await window.look()
  window.scrollTo(4000)
  await new Promise(setImmediate)
  window.filter.value = { ...NO_FILTER, text: 'tenth' }
  await window.look()
  assert.equal(shown(window).at(-1), 4990)
})

test('one question at a time, and what changed meanwhile is asked afterwards', async () => {
  let answer
  const asked = []
  const window = new TraceWindow((command) => new Promise((done) => (asked.push(command), (answer = done))))
  const first = window.look()
  window.look()
  window.look()
  assert.equal(asked.length, 1)
  const none = { matching: 0, from: 0, rows: [] }
  answer(none)
  await new Promise(setImmediate)
  assert.equal(asked.length, 2)
  answer(none)
  await first
  assert.equal(asked.length, 2)
})
