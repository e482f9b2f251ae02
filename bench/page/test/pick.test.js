import assert from 'node:assert/strict'
import { test } from 'node:test'
import { matches, treeRows, withValues } from '../src/pick.js'

const entry = (address, object, name, group, unit = null) => ({ address, object, name, group, unit, value: null })
const ENTRIES = [
  entry('1018:00', 'Identity object', 'Highest sub-index', 'Communication'),
  entry('1018:01', 'Identity object', 'Vendor-ID', 'Communication'),
  entry('6081:00', 'Profile velocity', 'Profile velocity', 'Drive', 'rpm'),
]
const keys = (rows) => rows.map(({ kind, key, level }) => `${'  '.repeat(level - 1)}${kind} ${key}`)

test('an entry is found by number, names, group and unit, in any case', () => {
  for (const query of ['6081', '0x6081', '6081h', '6081:00', 'velocity profile', 'DRIVE', 'rpm']) {
    assert.ok(matches(ENTRIES[2], query), query)
    assert.ok(!matches(ENTRIES[0], query), query)
  }
  // An h that is no mark of a number belongs to its word.
  assert.ok(matches(ENTRIES[0], 'high'))
  assert.ok(!matches(ENTRIES[2], 'velocith'))
})

test('the tree has groups, objects of several entries, and entries', () => {
  const all = [
    'group Communication',
    '  object 1018',
    '    entry 1018:00',
    '    entry 1018:01',
    'group Drive',
    '  entry 6081:00',
  ]
  assert.deepEqual(keys(treeRows(ENTRIES, '', new Set())), all)
  assert.deepEqual(keys(treeRows(ENTRIES, '', new Set(['1018', 'Drive']))), [
    'group Communication',
    '  object 1018',
    'group Drive',
  ])
})

test('a query opens what is folded, and leaves the rest out', () => {
  const rows = treeRows(ENTRIES, ' vendor ', new Set(['Communication', '1018']))
  assert.deepEqual(keys(rows), ['group Communication', '  object 1018', '    entry 1018:01'])
})

test('values that were read come to their entries', () => {
  const [, vendor, velocity] = withValues(ENTRIES, [{ address: '1018:01', text: '0x195' }])
  assert.equal(vendor.value.text, '0x195')
  assert.equal(velocity, ENTRIES[2])
})
