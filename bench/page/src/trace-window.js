// The part of the trace that is in sight. Rows around it are requested one request at a time, so that a slow bench gets
// no more requests than it can answer.
import { batch, signal } from '@preact/signals'
import { NO_FILTER } from './words.js'
import { placeOf, windowOf } from './scroll.js'

const MARGIN = 80 // rows to request beyond those in sight, so that small steps need no request
const QUESTIONS = 10 // the bench filters its rows in parts: after so many requests it has been through all

export class TraceWindow {
  constructor(ask) {
    this.ask = ask
    this.filter = signal(NO_FILTER)
    this.isFollowing = signal(true)
    this.chosen = signal(null) // the number of a row
    this.top = signal(0) // the index of the row at the top, with a fraction
    this.frames = signal({ matching: 0, from: 0, rows: [] })
    this.refused = signal(null)
    this.visible = 30
    this.isBusy = this.isLate = false
  }

  /** The rows in sight, and the index of the first one. */
  get shown() {
    const { from, rows } = this.frames.value
    const first = Math.max(from, Math.floor(this.top.value))
    return { first, rows: rows.slice(first - from, first - from + this.visible + 1) }
  }

  resize(visible) {
    this.visible = visible
    this.look()
  }

  follow() {
    this.isFollowing.value = true
    this.look()
  }

  hold() {
    this.isFollowing.value = false
  }

  scrollTo(place) {
    this.hold()
    this.top.value = Math.max(0, Math.min(place, this.lastTop(this.frames.peek().matching)))
    const { from, rows, matching } = this.frames.peek()
    const isNear = (place, edge) => Math.abs(place - edge) < MARGIN / 4
    const [top, end] = [this.top.peek(), this.top.peek() + this.visible]
    const isMissing = top < from || end > from + rows.length
    if (
      isMissing ||
      (from > 0 && isNear(top, from)) ||
      (from + rows.length < matching && isNear(end, from + rows.length))
    )
      this.look()
  }

  scrollBy(rows) {
    this.scrollTo(this.top.peek() + rows)
  }

  /** Keeps the row at the top in sight, or the next one that matches. */
  async setFilter(filter) {
    const number = this.isFollowing.peek() ? null : this.shown.rows[0]?.number
    this.filter.value = filter
    if (number === null || number === undefined) return this.look()
    await this.goTo(number, 0)
  }

  /** Shows a row without a filter, so that all rows before it are there. */
  async jumpTo(number) {
    this.filter.value = NO_FILTER
    this.chosen.value = number
    await this.goTo(number, 0.6)
  }

  /** Scrolls so that a row, or the next one that matches, is at a part of the window's height. */
  async goTo(number, part) {
    this.hold()
    const filter = this.filter.peek()
    const rows = (from) => {
      if (filter !== this.filter.peek()) throw null // The user has changed the filter meanwhile.
      return this.ask({ do: 'trace', filter, from, count: 1 })
    }
    try {
      let last = await rows(-1)
      for (let asked = 1; asked < QUESTIONS && !(last.rows[0]?.number >= number); asked++) last = await rows(-1)
      const place = await placeOf(number, last.matching, async (place) => (await rows(place)).rows[0])
      batch(() => {
        this.frames.value = { ...this.frames.peek(), matching: last.matching }
        this.top.value = Math.max(0, Math.min(place - part * this.visible, this.lastTop(last.matching)))
      })
      this.look()
    } catch (why) {
      if (why !== null) this.refused.value = why
    }
  }

  lastTop(matching) {
    return Math.max(0, matching - this.visible + 1)
  }

  async look() {
    if (this.isBusy) return void (this.isLate = true)
    this.isBusy = true
    do {
      this.isLate = false
      await this.lookOnce()
    } while (this.isLate)
    this.isBusy = false
  }

  async lookOnce() {
    const filter = this.filter.peek()
    const count = this.visible + MARGIN
    const wanted = this.isFollowing.peek() ? { from: -count, count } : windowOf(this.top.peek(), this.visible, MARGIN)
    try {
      const found = await this.ask({ do: 'trace', filter, ...wanted })
      if (filter === this.filter.peek()) batch(() => this.take(found))
      else this.isLate = true
    } catch (why) {
      this.refused.value = why
    }
  }

  take(found) {
    if (this.isFollowing.peek()) this.top.value = this.lastTop(found.matching)
    else this.top.value = Math.min(this.top.peek() - this.forgotten(found), this.lastTop(found.matching))
    this.frames.value = found
    this.refused.value = null
    // Fewer rows match than the number at which the requested ones begin.
    if (found.matching > 0 && this.shown.rows.length === 0) this.isLate = true
  }

  /** How far the indexes of rows have shifted because the oldest were dropped, so that the view stays in place. */
  forgotten(found) {
    const { from, rows } = this.frames.peek()
    const place = Math.floor(this.top.peek())
    const row = rows[place - from]
    const now = row ? found.rows.findIndex(({ number }) => number === row.number) : -1
    return now < 0 ? 0 : Math.max(0, place - (found.from + now))
  }
}
