// Numbers and times. In every language, numbers are written as the bench reads them: with a decimal point and no
// thousands separator. So what is shown beside a field can be typed into it, and the page parses no number itself.

export const NONE = '–'

const isNone = (value) => value === null || value === undefined

export const number = (value, digits = 0) => (isNone(value) ? NONE : value.toFixed(digits))

/** With as many digits as are significant: 1234.5, 12.34, 0.0123. */
export function measured(value) {
  if (isNone(value)) return NONE
  return plain(Number(value.toPrecision(Math.abs(value) >= 1e5 ? 9 : 6)))
}

/** With all digits of the bench, for a value that may be typed again. */
export const exact = (value) => (isNone(value) ? NONE : plain(value))

/** Without an exponent, if that is readable. */
function plain(value) {
  const text = String(value)
  return text.includes('e-') ? value.toFixed(12).replace(/\.?0+$/, '') : text
}

export const percent = (value) => (isNone(value) ? NONE : `${number(value, 1)} %`)
export const ms = (value) => (isNone(value) ? NONE : `${number(value, value < 10 ? 1 : 0)} ms`)

/** `1:02:03.456`, always with a decimal point, because times are compared with a log. */
export function clock(seconds, digits = 3) {
  const rounded = Number(seconds.toFixed(digits))
  const minutes = Math.floor(rounded / 60)
  const rest = (rounded - minutes * 60).toFixed(digits).padStart(digits + 3, '0')
  return minutes < 60
    ? `${minutes}:${rest}`
    : `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, '0')}:${rest}`
}

/** `0x000001AE`, for identities. */
export const hex = (value, digits = 8) =>
  isNone(value) ? NONE : `0x${value.toString(16).toUpperCase().padStart(digits, '0')}`
