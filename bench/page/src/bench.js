// The only bench of this page, and how views send requests to it.
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
 * What a request brings; rejects with a `Refused`.
 * @template {Request} R
 * @param {R} request
 */
export const ask = (request) => bench.ask(request)

/**
 * The last refusal, shown in the footer: of requests whose button has no place for it.
 * @type {Signal<Refused | null>}
 */
export const refusal = signal(null)

/**
 * Returns what the request brings, or null if it is refused.
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
 * Requests a file, and gives it to the browser.
 * @param {Extract<Request, { do: 'export' | 'export-plot' | 'record' | 'play-sequence' }>} request
 */
export async function sendForFile(request) {
  const file = await send(request)
  if (file) save(file)
}

/**
 * A function to send requests, and the state of the last one. The function returns what a request brings, or null if it
 * is refused.
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
 * How the last stop went: `{ number, state, ms, why }`, where the state is `'sent'`, `'answered'` (every drive has
 * stopped), `'past'`, `'unanswered'`, `'refused'`, `'confirmed'` or `'unsent'`.
 */
export const stop = signal(null)
effect(() => (stop.value = stopSince(stop.value, view.drives.value)))
const PATIENCE = 1000 // ms until a stop that is not confirmed is shown as such
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
