// Numbers and times, as a reader of this language expects them.
import { language } from './i18n/index.js'

const formats = new Map()

function format(options) {
  const key = language.value + JSON.stringify(options)
  if (!formats.has(key)) formats.set(key, new Intl.NumberFormat(language.value, options))
  return formats.get(key)
}

export const NONE = '–'

export function number(value, digits = 0) {
  if (value === null || value === undefined) return NONE
  return format({ minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value)
}

/** With as many digits as the value is worth: 1234.5, 12.34, 0.0123. */
export function measured(value) {
  if (value === null || value === undefined) return NONE
  return format({ maximumSignificantDigits: Math.abs(value) >= 1e5 ? 9 : 6 }).format(value)
}

export const percent = (value) => (value === null || value === undefined ? NONE : `${number(value, 1)} %`)
export const ms = (value) => (value === null || value === undefined ? NONE : `${number(value, value < 10 ? 1 : 0)} ms`)

/** `1:02:03.456`; times are compared with a log, so the decimal sign stays a point. */
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
  value === null || value === undefined ? NONE : `0x${value.toString(16).toUpperCase().padStart(digits, '0')}`
