// The one bench of this page, and what views ask of it.
import { useState } from 'preact/hooks'
import { signal } from '@preact/signals'
import { Bench, socketUrl, takeToken } from './socket.js'
import { applyView, connection, face, version } from './state.js'
import { saveFile } from './files.js'

let bench = null

export function connect() {
  bench = new Bench(socketUrl(takeToken()), {
    state: (state) => (connection.value = state === 'connecting' && connection.value === 'lost' ? 'lost' : state),
    hello: (hello) => {
      face.value = hello.face
      version.value = hello.version
    },
    view: applyView,
  })
}

/** The value of a command's answer. */
export const ask = (command) => bench.ask(command).then(({ value }) => value)

/** What was refused last, for all to see: orders whose button has no place for it. */
export const refusal = signal(null)

export function order(command) {
  refusal.value = null
  return ask(command).catch((refused) => {
    refusal.value = refused
  })
}

/** Asks for a file, and hands it to the browser. */
export const orderFile = (command) => order(command).then((file) => file && saveFile(file.name, file.bytes))

/** A command with its state: `[{ busy, refused, done }, run]`. `run` gives the answer's value, or null when refused. */
export function useAsk() {
  const [state, setState] = useState({ busy: false, refused: null, done: false })
  const run = async (command) => {
    setState({ busy: true, refused: null, done: false })
    try {
      const value = await ask(command)
      setState({ busy: false, refused: null, done: true })
      return value ?? true
    } catch (refused) {
      setState({ busy: false, refused, done: false })
      return null
    }
  }
  return [state, run]
}

/** How the last stop went: `{ state: 'sent' | 'answered' | 'unanswered' | 'unsent', ms }`. */
export const stop = signal(null)
const PATIENCE = 1000 // ms until a stop counts as unanswered

export function stopAll() {
  const sent = performance.now()
  const number = (stop.value?.number ?? 0) + 1
  const set = (state, ms = 0) => {
    if (stop.value.number === number) stop.value = { number, state, ms }
  }
  const asked = bench.ask({ do: 'stop-all' })
  stop.value = { number, state: 'sent', ms: 0 }
  const late = setTimeout(() => set('unanswered', PATIENCE), PATIENCE)
  asked
    .then(
      () => set('answered', performance.now() - sent),
      (refused) => set(refused.why === 'lost' ? 'unsent' : 'unanswered'),
    )
    .finally(() => clearTimeout(late))
}
