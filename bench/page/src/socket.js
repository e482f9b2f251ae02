// The connection to the bench: commands out, views and answers in. It comes back by itself when it is lost.

const DELAYS = [250, 500, 1000, 2000, 3000] // ms until the next attempt

/**
 * `on` has `hello(hello)`, `view(changes)` and `state(state)`; what arrives in one frame of the display is one `view`.
 * A command's promise gives its answer as `{ kind, value }`, or fails with `{ why, remedy }`.
 */
export class Bench {
  constructor(url, on, { Socket = WebSocket, frame = nextFrame, delay = (run, ms) => setTimeout(run, ms) } = {}) {
    Object.assign(this, { url, on, Socket, frame, delay, asked: new Map(), lastId: 0, failures: 0, pending: null })
    this.open()
  }

  open() {
    this.on.state('connecting')
    const socket = new this.Socket(this.url)
    this.socket = socket
    socket.onopen = () => (this.failures = 0)
    socket.onmessage = (event) => this.take(JSON.parse(event.data))
    socket.onclose = () => this.lose()
  }

  lose() {
    for (const { fail } of this.asked.values()) fail({ why: 'lost', remedy: null })
    this.asked.clear()
    this.pending = null
    this.on.state('lost')
    this.delay(() => this.open(), DELAYS[Math.min(this.failures++, DELAYS.length - 1)])
  }

  take(message) {
    if (message.view) return this.gather(message.view)
    if (message.hello) {
      this.on.state('open')
      return this.on.hello(message.hello)
    }
    const asked = this.asked.get(message.id)
    if (!asked) return
    this.asked.delete(message.id)
    if (message.refused) asked.fail(message.refused)
    else asked.done(answer(message.answer))
  }

  /** Views may come faster than they can be seen. */
  gather(changes) {
    if (this.pending) return Object.assign(this.pending, changes)
    this.pending = { ...changes }
    this.frame(() => {
      const gathered = this.pending
      this.pending = null
      if (gathered) this.on.view(gathered)
    })
  }

  /** Sends at once, so that a stop waits for nothing on this side. */
  ask(command) {
    if (this.socket.readyState !== 1) return Promise.reject({ why: 'lost', remedy: null })
    const id = ++this.lastId
    this.socket.send(JSON.stringify({ id, ...command }))
    return new Promise((done, fail) => this.asked.set(id, { done, fail }))
  }
}

/** `"done"`, `{"values": [...]}` as `{ kind, value }`. */
export function answer(answer) {
  if (typeof answer === 'string') return { kind: answer, value: null }
  const [[kind, value]] = Object.entries(answer)
  return { kind, value }
}

/** Also in a page that is not shown, where the display has no frames. */
function nextFrame(run) {
  if (document.hidden) setTimeout(run, 250)
  else requestAnimationFrame(run)
}

/** Takes the token out of the address, so that it is neither seen nor bookmarked; it stays for this browser tab. */
export function takeToken(location = window.location, storage = sessionStorage) {
  const address = new URL(location.href)
  const token = address.searchParams.get('token')
  if (token) {
    storage.setItem('token', token)
    address.searchParams.delete('token')
    history.replaceState(null, '', address)
  }
  return token ?? storage.getItem('token')
}

export function socketUrl(token, location = window.location) {
  const url = new URL('ws', location.href)
  url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:'
  url.search = token ? `?${new URLSearchParams({ token })}` : ''
  url.hash = ''
  return url.href
}
