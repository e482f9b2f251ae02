import assert from 'node:assert/strict'
import { test } from 'node:test'
import { bounds, columns, crossing, extended, inSight, numberAt, thinned } from '../src/curves.js'

const curve = (address, points) => ({ node: 6, address, name: address, unit: 'deg', points })
const ramp = (count) => Array.from({ length: count }, (_, at) => [at, at])

test('news are added to their curves, once, and the oldest points go', () => {
  const before = [
    curve('6064:00', [
      [0, 1],
      [1, 2],
    ]),
    curve('606C:00', [[0, 5]]),
  ]
  const news = [
    curve('6064:00', [
      [1, 2],
      [2, 3],
    ]),
    curve('6077:00', [[2, 9]]),
  ]
  assert.deepEqual(
    extended(before, news, 100).map(({ address, points }) => [address, points]),
    [
      [
        '6064:00',
        [
          [0, 1],
          [1, 2],
          [2, 3],
        ],
      ],
      ['6077:00', [[2, 9]]],
    ],
  )
  assert.deepEqual(extended(before, news, 2)[0].points, [
    [1, 2],
    [2, 3],
  ])
})

test('a number holds until the next point', () => {
  const { points } = curve('6064:00', [
    [1, 10],
    [2, 20],
  ])
  assert.deepEqual(
    [0.9, 1, 1.9, 2, 99].map((time) => numberAt({ points }, time)),
    [null, 10, 10, 20, 20],
  )
})

test('what is in sight has the points at both edges', () => {
  assert.deepEqual(inSight(ramp(10), [3.5, 5.5]), [
    [3, 3],
    [4, 4],
    [5, 5],
    [6, 6],
  ])
  assert.deepEqual(inSight(ramp(3), [-5, 99]), ramp(3))
  assert.deepEqual(inSight([], [0, 1]), [])
  assert.equal(bounds([]), null)
  assert.deepEqual(
    bounds([
      [0, 3],
      [1, -2],
      [2, 1],
    ]),
    [-2, 3],
  )
})

test('thinned points keep every peak', () => {
  const points = ramp(100_000).map(([time]) => [time, time === 77_777 ? 1e6 : time === 5 ? -1e6 : Math.sin(time)])
  const few = thinned(points, 1000)
  assert.ok(few.length <= 1000, `${few.length}`)
  assert.deepEqual(bounds(few), [-1e6, 1e6])
  assert.ok(
    few.every(([time], at) => at === 0 || time > few[at - 1][0]),
    'ascending',
  )
  assert.equal(thinned(points.slice(0, 10), 1000).length, 10)
})

test('curves of different times share a column of times', () => {
  const data = columns([
    curve('a', [
      [1, 10],
      [3, 30],
    ]),
    curve('b', [
      [1, 5],
      [2, 6],
    ]),
  ])
  assert.deepEqual(data, [
    [1, 2, 3],
    [10, undefined, 30],
    [5, 6, undefined],
  ])
  assert.deepEqual(columns([]), [[]])
})

test('a trigger finds the first crossing in its direction after it was armed', () => {
  const wave = curve('a', [
    [0, 0],
    [1, 10],
    [2, 0],
    [3, 10],
  ])
  assert.equal(crossing(wave, 5, true, -1), 0.5)
  assert.equal(crossing(wave, 5, true, 1), 2.5)
  assert.equal(crossing(wave, 5, false, 0), 1.5)
  assert.equal(crossing(wave, 11, true, 0), null)
})
