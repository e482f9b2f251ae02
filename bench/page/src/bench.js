// The one bench of this page, and how views ask it.
import { useState } from 'preact/hooks'
import { effect, signal } from '@preact/signals'
import { save } from './files.js'
import { Bench, socketUrl, takeToken } from './socket.js'
import { applyView, connection, client, stopSince, version, view } from './state.js'

/**
 * @import { Refused, Request } from './wire'
 * @import { Brought } from './types'
 * @import { Signal } from '@preact/signals'
 */

/** @typedef {{ busy: boolean, refused: Refused | null, done: boolean }} Asked */

/** @type {Bench | null} */
let bench = null

export function connect() {
  const token = takeToken(location, sessionStorage, history)
  const probe = () => fetch(`/?${new URLSearchParams({ token })}`, { method: 'HEAD', cache: 'no-store' })
  const on = {
    state: (state) => (connection.value = state),
    hello: (hello) => {
      client.value = hello.client
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

/**
 * What a request brings; fails with a `Refused`.
 * @template {Request} R
 * @param {R} request
 */
export const ask = (request) => bench.ask(request)

/**
 * What was refused last, for all to see: of requests whose button has no place for it.
 * @type {Signal<Refused | null>}
 */
export const refusal = signal(null)

/**
 * Gives what the request brings, or null when it is refused.
 * @template {Request} R
 * @param {R} request
 */
export async function send(request) {
  refusal.value = null
  try {
    return await ask(request)
  } catch (refused) {
    refusal.value = refused
    return null
  }
}

/**
 * Asks for a file, and gives it to the browser.
 * @param {Extract<Request, { do: 'export' | 'export-plot' | 'record' | 'play-sequence' }>} request
 */
export async function sendForFile(request) {
  const file = await send(request)
  if (file) save(file)
}

/**
 * A request with its state. `run` gives what it brings, or null when refused.
 * @returns {[Asked, <R extends Request>(request: R) => Promise<Brought<R> | null>]}
 */
export function useAsk() {
  const [state, setState] = useState(/** @type {Asked} */ ({ busy: false, refused: null, done: false }))
  const run = async (request) => {
    setState({ busy: true, refused: null, done: false })
    try {
      const content = await ask(request)
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
