import assert from 'node:assert/strict'
import { test } from 'node:test'
import { extent, insert, move, place, placeOfBit, remove, usedBits } from '../src/bits.js'

const STATUS = { address: '6041:00', bits: 16 }
const POSITION = { address: '6064:00', bits: 32 }
const BIT = { address: '2010:01', bits: 1 }
const order = (fields) => fields.map(({ address, first_bit }) => `${address}@${first_bit}`).join(' ')

test('fields lie one after the other, however they are moved', () => {
  const fields = place([STATUS, POSITION, BIT])
  assert.equal(order(fields), '6041:00@0 6064:00@16 2010:01@48')
  assert.equal(order(move(fields, 2, 0)), '2010:01@0 6041:00@1 6064:00@17')
  assert.equal(order(move(fields, 0, 1)), '6064:00@0 6041:00@32 2010:01@48')
  assert.equal(move(fields, 0, -1), fields)
  assert.equal(move(fields, 2, 3), fields)
  assert.equal(order(remove(fields, 0)), '6064:00@0 2010:01@32')
  assert.equal(order(insert(fields, 1, BIT)), '6041:00@0 2010:01@16 6064:00@17 2010:01@49')
  assert.equal(usedBits(fields), 49)
  assert.deepEqual(
    [0, 15, 16, 48, 49].map((bit) => placeOfBit(fields, bit)),
    [0, 0, 1, 2, 3],
  )
})

test('places are named by bytes where they are whole bytes', () => {
  assert.deepEqual(extent({ first_bit: 16, bits: 32 }), { byte: 2, last: 5, bit: null, lastBit: null })
  assert.deepEqual(extent({ first_bit: 48, bits: 1 }), { byte: 6, last: 6, bit: 0, lastBit: 0 })
  assert.deepEqual(extent({ first_bit: 6, bits: 4 }), { byte: 0, last: 1, bit: 6, lastBit: 1 })
})
