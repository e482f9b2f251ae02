// The connection to the bench: requests out, views and answers in. It reconnects by itself when it is lost.
// The messages are those of bench/README.md.

const PROTOCOL = 'lexican-bench'
const DELAYS = [250, 500, 1000, 2000, 3000] // ms until the next attempt
const GONE = 1001 // the close code with which the bench ends

/**
 * @import { Brought, Connection } from './types'
 * @import { Request, ToPage, View } from './wire'
 */

/**
 * Is told about the connection.
 * @typedef {object} Listener
 * @property {(hello: { client: number, version: string }) => void} hello
 * @property {(changes: Partial<View>) => void} view
 * @property {(state: Connection) => void} state
 */

export class Bench {
  asked = new Map()
  lastId = 0
  failures = 0
  isOpen = false

  /** `isRefused()` resolves to whether the bench is there but does not know the token.
   * @param {string} url
   * @param {string | null} token
   * @param {Listener} on
   */
  constructor(
    url,
    token,
    on,
    { Socket = WebSocket, delay = (run, ms) => setTimeout(run, ms), isRefused = async () => false } = {},
  ) {
    this.url = url
    this.token = token
    this.on = on
    this.Socket = Socket
    this.delay = delay
    this.isRefused = isRefused
    if (token) this.open()
    else on.state('refused')
  }

  open() {
    const socket = new this.Socket(this.url, [PROTOCOL, this.token])
    this.socket = socket
    socket.onmessage = (event) => this.take(JSON.parse(event.data))
    socket.onclose = (event) => this.lose(event)
  }

  async lose({ code }) {
    for (const { fail } of this.asked.values()) fail({ why: 'lost', remedy: null })
    this.asked.clear()
    if (this.isOpen) this.on.state(code === GONE ? 'ended' : 'lost')
    else if (await this.isRefused()) return this.on.state('refused')
    else if (this.failures === DELAYS.length) this.on.state('lost')
    this.isOpen = false
    this.delay(() => this.open(), DELAYS[Math.min(this.failures++, DELAYS.length - 1)])
  }

  /** @param {{ view: Partial<View> } | ToPage} message */
  take(message) {
    if ('view' in message) {
      this.on.view(message.view)
      // The bench sends the next view only after this, so a slow page gets fewer of them.
      this.socket.send('{"seen":true}')
    } else if ('hello' in message) {
      this.isOpen = true
      this.failures = 0
      this.on.hello(message.hello)
      this.on.state('open')
    } else this.settle(message)
  }

  /** @param {Extract<ToPage, { id: number }>} outcome */
  settle({ id, ...outcome }) {
    const asked = this.asked.get(id)
    this.asked.delete(id)
    if ('refused' in outcome) asked?.fail(outcome.refused)
    else asked?.done(content(outcome.answer))
  }

  /**
   * Sends at once, so that nothing on this side delays a stop. Rejects with a `Refused`.
   * @template {Request} R
   * @param {R} request
   * @returns {Promise<Brought<R>>}
   */
  ask(request) {
    if (!this.isOpen || this.socket.readyState !== 1) return Promise.reject({ why: 'lost', remedy: null })
    const id = ++this.lastId
    this.socket.send(JSON.stringify({ id, ...request }))
    return new Promise((done, fail) => this.asked.set(id, { done, fail }))
  }
}

/** The content of an answer: `{"values": [...]}` has values, `"done"` means `true`. */
export const content = (answer) => (typeof answer === 'string' ? true : Object.values(answer)[0])

/** Removes the token from the address, so that it is neither seen nor bookmarked, and keeps it for this browser tab. */
export function takeToken(location, storage, history) {
  const address = new URL(location.href)
  const token = address.searchParams.get('token')
  if (!token) return storage.getItem('token')
  storage.setItem('token', token)
  address.searchParams.delete('token')
  history.replaceState(null, '', address.href)
  return token
}

export function socketUrl(location) {
  const url = new URL('ws', location.href)
  url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:'
  url.search = url.hash = ''
  return url.href
}
