// Curves from the bench, combined for a plot. Points are pairs of time and number, ascending in time.

export const keyOf = ({ node, address }) => `${node} ${address}`

/** The time of the newest point; the next request asks for points since then. */
export const newest = (curves) => curves.reduce((time, { points }) => Math.max(time, points.at(-1)?.[0] ?? 0), 0)

/** Adds new points to curves, keeping at most `most` points each. Curves that are not in `news` are dropped. */
export function extended(curves, news, most) {
  const before = new Map(curves.map((curve) => [keyOf(curve), curve.points]))
  return news.map((curve) => {
    const old = before.get(keyOf(curve)) ?? []
    const last = old.at(-1)?.[0] ?? -Infinity
    const points = old.concat(curve.points.slice(placeAfter(curve.points, last)))
    return { ...curve, points: points.length > most ? points.slice(-most) : points }
  })
}

/** The index of the first point after a time. */
function placeAfter(points, time) {
  let [low, high] = [0, points.length]
  while (low < high) {
    const middle = (low + high) >> 1
    if (points[middle][0] <= time) low = middle + 1
    else high = middle
  }
  return low
}

/** The value of a curve at a time: that of the last point up to then; null before the first one. */
export const numberAt = ({ points }, time) => points[placeAfter(points, time) - 1]?.[1] ?? null

/** The points within a range of time, and the nearest one on each side, so that the line reaches the edges. */
export function inSight(points, [from, to]) {
  return points.slice(Math.max(0, placeAfter(points, from) - 1), placeAfter(points, to) + 1)
}

/** The lowest and the highest number; null if there are none. */
export function bounds(points) {
  if (points.length === 0) return null
  let [low, high] = [Infinity, -Infinity]
  for (const [, number] of points) {
    if (number < low) low = number
    if (number > high) high = number
  }
  return [low, high]
}

/** About `most` points that look the same: the lowest and the highest one of each stretch. */
export function thinned(points, most) {
  if (points.length <= most) return points
  const stretch = Math.ceil((2 * points.length) / most)
  const kept = []
  for (let at = 0; at < points.length; at += stretch) {
    let [low, high] = [at, at]
    for (let each = at; each < Math.min(at + stretch, points.length); each++) {
      if (points[each][1] < points[low][1]) low = each
      if (points[each][1] > points[high][1]) high = each
    }
    kept.push(points[Math.min(low, high)])
    if (low !== high) kept.push(points[Math.max(low, high)])
  }
  return kept
}

/**
 * A column of times, and one of numbers for each curve, as uPlot takes them. A curve without a point at a time has
 * `undefined` there, over which uPlot draws its line.
 */
export function columns(curves) {
  const places = curves.map(() => 0)
  const [times, ...numbers] = [[], ...curves.map(() => [])]
  for (;;) {
    const time = curves.reduce(
      (least, { points }, at) => Math.min(least, points[places[at]]?.[0] ?? Infinity),
      Infinity,
    )
    if (time === Infinity) return [times, ...numbers]
    times.push(time)
    curves.forEach(({ points }, at) => {
      const isHere = points[places[at]]?.[0] === time
      numbers[at].push(isHere ? points[places[at]][1] : undefined)
      if (isHere) places[at]++
    })
  }
}

/** When a curve first crosses a level after a time, rising or falling; null if it does not. */
export function crossing({ points }, level, rising, after) {
  for (let at = Math.max(1, placeAfter(points, after)); at < points.length; at++) {
    const [[earlier, from], [later, to]] = [points[at - 1], points[at]]
    if (rising ? from < level && to >= level : from > level && to <= level) {
      return earlier + ((later - earlier) * (level - from)) / (to - from)
    }
  }
  return null
}
