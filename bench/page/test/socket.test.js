import assert from 'node:assert/strict'
import { beforeEach, test } from 'node:test'
import { Bench, socketUrl, takeToken } from '../src/socket.js'

let sockets, states, views, delayed, isRefused

class Socket {
  constructor(url, protocols) {
    Object.assign(this, { url, protocols, readyState: 1, sent: [] })
    sockets.push(this)
  }
  send(text) {
    this.sent.push(JSON.parse(text))
  }
  hear(message) {
    this.onmessage({ data: JSON.stringify(message) })
  }
}

function open(token = 'secret') {
  const on = { state: (state) => states.push(state), hello: () => {}, view: (view) => views.push(view) }
  const bench = new Bench('ws://x/ws', token, on, {
    Socket,
    delay: (run) => delayed.push(run),
    isRefused: async () => isRefused,
  })
  return { bench, socket: sockets[0] }
}

beforeEach(() => {
  isRefused = false
  ;[sockets, states, views, delayed] = [[], [], [], []]
})

test('a page names the protocol and its token, and says that it has seen a view', () => {
  const { socket } = open()
  assert.deepEqual(socket.protocols, ['lexican-bench', 'secret'])
  socket.hear({ hello: { client: 1, version: '0' } })
  socket.hear({ view: { time: 1 } })
  assert.deepEqual([states, views, socket.sent], [['open'], [{ time: 1 }], [{ seen: true }]])
})

test('answers come to their commands, in any order', async () => {
  const { bench, socket } = open()
  socket.hear({ hello: {} })
  const [values, done, refused] = [bench.ask({ do: 'read' }), bench.ask({ do: 'scan' }), bench.ask({ do: 'write' })]
  socket.hear({ id: 3, refused: { why: 'above its limit', remedy: 'less' } })
  socket.hear({ id: 2, answer: 'done' })
  socket.hear({ id: 1, answer: { values: [7] } })
  socket.hear({ id: 99, answer: 'done' })
  assert.deepEqual([await values, await done], [[7], true])
  await assert.rejects(refused, { why: 'above its limit', remedy: 'less' })
  assert.deepEqual(socket.sent[0], { id: 1, do: 'read' })
})

test('a lost connection fails what was asked, says so, and comes back', async () => {
  const { bench, socket } = open()
  socket.hear({ hello: {} })
  const asked = bench.ask({ do: 'stop-all' })
  await socket.onclose({ code: 1006 })
  await assert.rejects(asked, { why: 'lost' })
  await assert.rejects(bench.ask({ do: 'stop-all' }), { why: 'lost' })
  delayed.shift()()
  sockets[1].hear({ hello: {} })
  assert.deepEqual(states, ['open', 'lost', 'open'])
})

test('an ended bench, a bench that does not come up, and a wrong token are told apart', async () => {
  const { socket } = open()
  socket.hear({ hello: {} })
  await socket.onclose({ code: 1001 })
  assert.deepEqual(states, ['open', 'ended'])
  for (let at = 1; at < 7; at++) {
    delayed.shift()()
    await sockets[at].onclose({ code: 1006 })
  }
  assert.equal(states.at(-1), 'lost')
  isRefused = true
  delayed.shift()()
  await sockets[7].onclose({ code: 1006 })
  assert.deepEqual([states.at(-1), delayed.length], ['refused', 0])
})

test('without a token nothing is tried', () => {
  open(null)
  assert.deepEqual([states, sockets], [['refused'], []])
})

test('the token is taken out of the address and kept', () => {
  const kept = new Map()
  const storage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) }
  let shown = null
  const history = { replaceState: (_, __, address) => (shown = address) }
  assert.equal(takeToken({ href: 'http://127.0.0.1:1/?token=ab#trace' }, storage, history), 'ab')
  assert.equal(shown, 'http://127.0.0.1:1/#trace')
  assert.equal(takeToken({ href: 'http://127.0.0.1:1/' }, storage, history), 'ab')
  assert.equal(socketUrl({ href: 'https://bench.example/?x#y', protocol: 'https:' }), 'wss://bench.example/ws')
})
