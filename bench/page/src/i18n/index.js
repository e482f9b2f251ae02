// The page's texts. What comes from the bench (faults, reasons, names of data sheets) stays as the bench says it.
import { signal } from '@preact/signals'
import de from './de.js'
import en from './en.js'

export const DICTIONARIES = { en, de }
const KEY = 'language'

/**
 * The language that the address asks for (`lexican bench --lang`), else the one that was chosen last, else the browser's. What the address
 * asks for is taken out of it, and stays chosen.
 */
export function firstLanguage({ location, localStorage, history, navigator } = globalThis) {
  const address = location && new URL(location.href)
  const asked = address?.searchParams.get('lang')
  if (asked) {
    address.searchParams.delete('lang')
    history.replaceState(null, '', address.href)
    if (asked in DICTIONARIES) localStorage.setItem(KEY, asked)
  }
  const kept = localStorage?.getItem(KEY)
  if (kept in DICTIONARIES) return kept
  const wanted = navigator?.languages ?? []
  return wanted.map((tag) => tag.slice(0, 2)).find((tag) => tag in DICTIONARIES) ?? 'en'
}

export const language = signal(firstLanguage())

export function setLanguage(next) {
  language.value = next
  localStorage.setItem(KEY, next)
}

/** The text of `key`, with `{name}` replaced by `values.name`. */
export function t(key, values = {}) {
  const text = DICTIONARIES[language.value][key] ?? DICTIONARIES.en[key] ?? key
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '')
}
