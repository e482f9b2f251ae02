// The one bench of this page, and how views ask it.
import { useState } from 'preact/hooks'
import { effect, signal } from '@preact/signals'
import { save } from './files.js'
import { Bench, socketUrl, takeToken } from './socket.js'
import { applyView, connection, face, stopSince, version, view } from './state.js'

let bench = null

export function connect() {
  const token = takeToken(location, sessionStorage, history)
  const probe = () => fetch(`/?${new URLSearchParams({ token })}`, { method: 'HEAD', cache: 'no-store' })
  const on = {
    state: (state) => (connection.value = state),
    hello: (hello) => {
      face.value = hello.face
      version.value = hello.version
    },
    view: applyView,
  }
  bench = new Bench(socketUrl(location), token, on, {
    isRefused: () =>
      probe().then(
        (answer) => answer.status === 403,
        () => false,
      ),
  })
}

/** What a command brings; fails with `{ why, remedy }`. */
export const ask = (command) => bench.ask(command)

/** What was refused last, for all to see: of orders whose button has no place for it. */
export const refusal = signal(null)

/** Gives what the command brings, or null when it is refused. */
export async function order(command) {
  refusal.value = null
  try {
    return await ask(command)
  } catch (refused) {
    refusal.value = refused
    return null
  }
}

/** Asks for a file, and hands it to the browser. */
export async function orderFile(command) {
  const file = await order(command)
  if (file) save(file)
}

/** A command with its state: `[{ busy, refused, done }, run]`. `run` gives what it brings, or null when refused. */
export function useAsk() {
  const [state, setState] = useState({ busy: false, refused: null, done: false })
  const run = async (command) => {
    setState({ busy: true, refused: null, done: false })
    try {
      const content = await ask(command)
      setState({ busy: false, refused: null, done: true })
      return content
    } catch (refused) {
      setState({ busy: false, refused, done: false })
      return null
    }
  }
  return [state, run]
}

/**
 * How the last stop went: `{ number, state: 'sent' | 'answered' | 'past' | 'unanswered' | 'refused' | 'confirmed' | 'unsent', ms, why }`. The
 * answer comes when every drive has stopped. */
export const stop = signal(null)
effect(() => (stop.value = stopSince(stop.value, view.drives.value)))
const PATIENCE = 1000 // ms until a stop that is not confirmed is said to be so
const SEEN = 10_000 // ms for which a confirmed one is shown

export function stopAll() {
  const asked = bench.ask({ do: 'stop-all' }) // before anything else
  const sent = performance.now()
  const number = (stop.peek()?.number ?? 0) + 1
  const set = (state, rest) => {
    if (stop.peek().number === number) stop.value = { number, state, ms: performance.now() - sent, ...rest }
  }
  stop.value = { number, state: 'sent', ms: 0 }
  const late = setTimeout(set, PATIENCE, 'unanswered')
  const ended = (state, rest) => {
    clearTimeout(late)
    set(state, rest)
  }
  asked.then(
    () => {
      ended('answered')
      setTimeout(() => stop.peek().number === number && (stop.value = { ...stop.peek(), state: 'past' }), SEEN)
    },
    ({ why }) => (why === 'lost' ? ended('unsent') : ended('refused', { why })),
  )
}
