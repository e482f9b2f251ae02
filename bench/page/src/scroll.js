// Scrolling through more rows than fit into the greatest height of a browser's element.

/** Above this height browsers lose pixels (Firefox at about 17 million). */
const MOST = 8_000_000

/** Maps `count` rows of `height` px to a scroll bar, in a window of `shown` px. */
export function scale(count, height, shown) {
  const all = count * height
  const extent = Math.min(all, MOST)
  const rows = Math.max(0, count - shown / height) // the last row that can be at the top
  const span = Math.max(0, extent - shown)
  return { extent, rows, span, perPixel: span > 0 ? rows / span : 0 }
}

/** The row at the top, with a fraction, for a position of the scroll bar; and the inverse. */
export const topRow = ({ perPixel }, scrollTop) => scrollTop * perPixel
export const scrollTopOf = ({ perPixel }, row) => (perPixel > 0 ? row / perPixel : 0)

/** The whole rows to request: those in sight and a margin around them, at most as many as an answer may have. */
export function windowOf(top, visible, margin) {
  const from = Math.max(0, Math.floor(top) - margin)
  return { from, count: Math.min(1000, Math.ceil(top + visible) + margin - from) }
}

/**
 * The index of the first matching row whose number is at least `number`, by binary search: twenty requests for a
 * million rows. `rowAt` requests the row at an index.
 */
export async function placeOf(number, count, rowAt) {
  let [low, high] = [0, count]
  while (low < high) {
    const middle = (low + high) >> 1
    const row = await rowAt(middle)
    if (!row || row.number >= number) high = middle
    else low = middle + 1
  }
  return low
}
