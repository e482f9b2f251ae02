// The page's texts. What comes from the bench (faults, reasons, names of data sheets) stays as the bench says it.
import { signal } from '@preact/signals'
import de from './de.js'
import en from './en.js'

export const DICTIONARIES = { en, de }
const KEY = 'language'

const preferred = () => {
  const kept = globalThis.localStorage?.getItem(KEY)
  if (kept in DICTIONARIES) return kept
  const wanted = globalThis.navigator?.languages ?? []
  return wanted.map((tag) => tag.slice(0, 2)).find((tag) => tag in DICTIONARIES) ?? 'en'
}

export const language = signal(preferred())

export function setLanguage(next) {
  language.value = next
  localStorage.setItem(KEY, next)
}

/** The text of `key`, with `{name}` replaced by `values.name`. */
export function t(key, values = {}) {
  const text = DICTIONARIES[language.value][key] ?? DICTIONARIES.en[key] ?? key
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '')
}
