// The page's texts. What comes from the bench (faults, reasons, names of data sheets) stays as the bench says it.
import { signal } from '@preact/signals'
import { TEXTS } from './texts.js'

/** In the order of the texts. */
export const LANGUAGES = ['en', 'de']
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
    if (LANGUAGES.includes(asked)) localStorage.setItem(KEY, asked)
  }
  const kept = localStorage?.getItem(KEY)
  if (LANGUAGES.includes(kept)) return kept
  const wanted = navigator?.languages ?? []
  return wanted.map((tag) => tag.slice(0, 2)).find((tag) => LANGUAGES.includes(tag)) ?? 'en'
}

export const language = signal(firstLanguage())

export function setLanguage(next) {
  language.value = next
  localStorage.setItem(KEY, next)
}

/** The text of `key`, with `{name}` replaced by `values.name`. */
export function t(key, values = {}) {
  const text = TEXTS[key]?.[LANGUAGES.indexOf(language.value)] ?? key
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '')
}
