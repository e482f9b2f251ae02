import assert from 'node:assert/strict'
import { readFileSync, readdirSync } from 'node:fs'
import { fileURLToPath } from 'node:url'
import { test } from 'node:test'
import { clock, exact, hex, measured, ms, number, percent } from '../src/format.js'
import { LANGUAGES, firstLanguage, language, t } from '../src/i18n/index.js'
import { TEXTS } from '../src/i18n/texts.js'
import { PLACES, STATES, arrow, lines, orderTo } from '../src/machine.js'
import { TRANSITIONS } from '../src/words.js'

const SOURCES = fileURLToPath(new URL('../src/', import.meta.url))
const read = (name) => readFileSync(SOURCES + name, 'utf8')
const code = readdirSync(SOURCES, { recursive: true })
  .filter((name) => name.endsWith('.jsx'))
  .map(read)
  .join('\n')

test('every language has every text, with the same places for values', () => {
  const places = (text) => [...text.matchAll(/\{\w+\}/g)].map(([place]) => place).sort()
  for (const [key, texts] of Object.entries(TEXTS)) {
    assert.equal(texts.length, LANGUAGES.length, key)
    for (const text of texts) assert.deepEqual(places(text), places(texts[0]), key)
  }
})

test('every text that is asked for is there', () => {
  const keys = [...code.matchAll(/\bt\('([^']+)'/g)].map(([, key]) => key)
  assert.ok(keys.length > 100, `${keys.length}`)
  for (const key of keys) assert.ok(key in TEXTS, key)
})

test('the address chooses the language for good, else the last choice, else the browser', () => {
  const kept = new Map()
  const localStorage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) }
  const navigator = { languages: ['fr', 'en-GB', 'de'] }
  const first = (href) => {
    const history = { replaceState: (_state, _title, address) => (href = address) }
    return [firstLanguage({ location: { href }, localStorage, history, navigator }), href]
  }
  assert.deepEqual(first('http://h/?token=a'), ['en', 'http://h/?token=a'])
  assert.deepEqual(first('http://h/?token=a&lang=fr#bus'), ['en', 'http://h/?token=a#bus'])
  assert.deepEqual(first('http://h/?token=a&lang=de#bus'), ['de', 'http://h/?token=a#bus'])
  assert.deepEqual(first('http://h/#bus'), ['de', 'http://h/#bus'])
  assert.deepEqual(firstLanguage({ navigator }), 'en')
})

test('numbers are written as the bench takes them, in every language', () => {
  for (const tag of LANGUAGES) {
    language.value = tag
    assert.deepEqual(
      [number(1234567), percent(12.34), ms(0.42), ms(1000), measured(-0.012345678)],
      ['1234567', '12.3 %', '0.4 ms', '1000 ms', '-0.0123457'],
    )
    assert.deepEqual([number(null), measured(undefined), hex(null)], ['–', '–', '–'])
    for (const value of [0, 5, 5000, -5000, 12.5, 47.11, 2147483647, -2147483648, 0.001, 1e-7]) {
      const text = exact(value)
      assert.match(text, /^-?\d+(\.\d+)?$/)
      assert.equal(Number(text), value)
    }
  }
  language.value = 'en'
})

test('the page reads no number by itself', () => {
  const fields = code.match(/<(?:input|Field)\b[^]*?\/>/g).filter((field) => field.includes('type="number"'))
  assert.deepEqual(
    fields.filter((field) => !field.includes('data-test="lss-node"')),
    [],
    'a browser reads 5.000 by its own language',
  )
  assert.doesNotMatch(code, /Intl\.|toLocale|parseFloat/)
})

test('times and numbers of identities are written as in logs', () => {
  assert.deepEqual([clock(0), clock(61.5), clock(3723.4567, 2)], ['0:00.000', '1:01.500', '1:02:03.46'])
  assert.equal(clock(59.9996), '1:00.000')
  assert.equal(hex(0x1ae), '0x000001AE')
})

test('texts have a contrast of 4.5 to 1 on their grounds, light and dark', () => {
  const pairs = new Map(
    [...read('style.css').matchAll(/--([\w-]+): light-dark\((#\w+), (#\w+)\)/g)].map(([, name, ...both]) => [
      name,
      both,
    ]),
  )
  const light = (color) => {
    const [r, g, b] = [1, 3, 5]
      .map((at) => parseInt(color.slice(at, at + 2), 16) / 255)
      .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
  }
  const contrast = (a, b) => (Math.max(light(a), light(b)) + 0.05) / (Math.min(light(a), light(b)) + 0.05)
  const grounds = ['panel', 'raised', 'ground']
  const uses = ['text', 'text-soft', 'accent', 'bad'].flatMap((text) => grounds.map((ground) => [text, ground]))
  uses.push(
    ...['good', 'warn', 'bad'].flatMap((text) => [
      [text, `${text}-ground`],
      ['text', `${text}-ground`],
      [text, 'panel'],
    ]),
  )
  uses.push(['text', 'accent-ground'], ['accent', 'accent-ground'], ['text-soft', 'line-soft'], ['on-accent', 'accent'])
  for (const [text, ground] of uses) {
    for (const scheme of [0, 1]) {
      const found = contrast(pairs.get(text)[scheme], pairs.get(ground)[scheme])
      assert.ok(found >= 4.5, `${text} on ${ground}, ${['light', 'dark'][scheme]}: ${found.toFixed(2)}`)
    }
  }
})

test('the state machine has its transitions between states, and orders that lead to some', () => {
  for (const [number, from, to] of TRANSITIONS.filter(([number]) => number in PLACES)) {
    assert.ok(from in STATES && to in STATES, `${number}`)
    assert.ok(arrow(from, to, PLACES[number]).line.every(Number.isFinite), `${number}`)
  }
  assert.deepEqual(lines('READY TO SWITCH ON'), ['READY TO', 'SWITCH ON'])
  assert.deepEqual(lines('FAULT'), ['FAULT'])
  assert.equal(orderTo('SWITCH ON DISABLED', 'FAULT'), 'reset-fault')
  assert.equal(orderTo('SWITCH ON DISABLED', 'SWITCHED ON'), 'disable')
  assert.equal(orderTo('OPERATION ENABLED', 'SWITCH ON DISABLED'), 'enable')
  assert.equal(orderTo('OPERATION ENABLED', 'FAULT'), null)
  assert.equal(orderTo('QUICK STOP ACTIVE', 'SWITCHED ON'), null)
  assert.equal(orderTo('SWITCHED ON', 'OPERATION ENABLED'), null)
  assert.equal(orderTo('SWITCH ON DISABLED', null), null)
})
