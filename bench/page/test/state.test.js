import assert from 'node:assert/strict'
import { test } from 'node:test'
import {
  applyView,
  chosenNode,
  connection,
  client,
  hasControl,
  node,
  parsePlace,
  stopSince,
  view,
  whyNot,
} from '../src/state.js'

test('only fields that have changed are taken over, and unknown ones left alone', () => {
  applyView({ nodes: [{ id: 5 }, { id: 6 }], later: 1 })
  applyView({ time: 2 })
  assert.deepEqual([view.time.value, view.nodes.value.length, view.later], [2, 2, undefined])
})

test('the node that is looked at is the chosen one while it is there', () => {
  chosenNode.value = 6
  assert.equal(node.value.id, 6)
  applyView({ nodes: [{ id: 5 }] })
  assert.equal(node.value.id, 5)
  applyView({ nodes: [] })
  assert.equal(node.value, null)
})

test('something can be changed with a connection, a bus and the control', () => {
  client.value = 2
  assert.equal(whyNot.value, 'control.lost')
  connection.value = 'open'
  assert.equal(whyNot.value, 'control.read-only')
  applyView({ bus: { ...view.bus.value, is_writable: true } })
  assert.equal(whyNot.value, 'control.first')
  applyView({ control: { holder: 1, clients: 2 } })
  assert.equal(hasControl.value, false)
  applyView({ control: { holder: 2, clients: 2 } })
  assert.deepEqual([hasControl.value, whyNot.value], [true, null])
})

test('a place of the address is a tab and a node, or the first tab', () => {
  assert.deepEqual(parsePlace('#objects/5'), { tab: 'objects', node: 5 })
  assert.deepEqual(parsePlace('#trace'), { tab: 'trace', node: null })
  assert.deepEqual(parsePlace('#nothing/128'), { tab: 'nodes', node: null })
})

test('a stop that was refused is confirmed once no drive lacks its confirmation', () => {
  const [standing, moving] = [[{ unconfirmed: null }], [{ unconfirmed: { since: 1, why: null } }]]
  const refused = { number: 1, state: 'refused', ms: 9 }
  assert.equal(stopSince(refused, standing), refused, 'nothing was sent, as to a bus that is only listened to')
  const sent = stopSince(refused, moving)
  assert.equal(stopSince(sent, moving), sent)
  assert.equal(sent.state, 'refused')
  assert.equal(stopSince(sent, standing).state, 'confirmed')
  assert.equal(stopSince(null, moving), null)
})
