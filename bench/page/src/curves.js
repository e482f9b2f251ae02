// Curves as the bench gives them, put together for a plot.

export const keyOf = ({ node, address }) => `${node} ${address}`

/** Curves with the points that came since; those that are not there any more are gone. At most `most` points each. */
export function extended(curves, news, most) {
  const before = new Map(curves.map((curve) => [keyOf(curve), curve]))
  return news.map((curve) => {
    const old = before.get(keyOf(curve))?.points ?? []
    const last = old.at(-1)?.[0] ?? -Infinity
    const points = old.concat(curve.points.filter(([time]) => time > last))
    return { ...curve, points: points.length > most ? points.slice(points.length - most) : points }
  })
}

/** The time of the newest point; the next question is for what came since. */
export const newest = (curves) => curves.reduce((time, { points }) => Math.max(time, points.at(-1)?.[0] ?? 0), 0)

/**
 * One column of times and one of numbers per curve, as uPlot takes it. A curve without a number at a time has
 * `undefined` there, which is no gap.
 */
export function columns(curves) {
  const times = [...new Set(curves.flatMap(({ points }) => points.map(([time]) => time)))].sort((a, b) => a - b)
  const place = new Map(times.map((time, at) => [time, at]))
  const numbers = curves.map(({ points }) => {
    const column = new Array(times.length)
    for (const [time, number] of points) column[place.get(time)] = number
    return column
  })
  return [times, ...numbers]
}

/** A curve's number at a time: that of the last point until then. */
export function numberAt({ points }, time) {
  let [low, high] = [0, points.length]
  while (low < high) {
    const middle = (low + high) >> 1
    if (points[middle][0] <= time) low = middle + 1
    else high = middle
  }
  return low === 0 ? null : points[low - 1][1]
}

/** When a curve first crosses a level after a time, rising or falling; null if it does not. */
export function crossing({ points }, level, rising, after) {
  for (let at = 1; at < points.length; at++) {
    const [[earlier, from], [later, to]] = [points[at - 1], points[at]]
    if (later <= after) continue
    if (rising ? from < level && to >= level : from > level && to <= level) {
      return earlier + ((later - earlier) * (level - from)) / (to - from)
    }
  }
  return null
}
