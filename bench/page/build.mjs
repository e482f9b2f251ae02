// Bundles the page into dist/, with the licences of what is bundled. With --check, compares instead of writing.
import { build } from 'esbuild'
import { readFileSync, writeFileSync, mkdirSync, existsSync } from 'node:fs'
import { dirname, join } from 'node:path'
import { fileURLToPath } from 'node:url'
import { gzipSync } from 'node:zlib'

const HERE = dirname(fileURLToPath(import.meta.url))
const DIST = join(HERE, 'dist')
const MOST = 300_000 // bytes, compressed

const bundled = await build({
  absWorkingDir: HERE,
  entryPoints: ['src/app.jsx', 'src/style.css'],
  outdir: 'dist',
  bundle: true,
  minify: true,
  write: false,
  metafile: true,
  format: 'esm',
  target: ['es2022', 'chrome110', 'firefox110', 'safari16'],
  jsx: 'automatic',
  jsxImportSource: 'preact',
  charset: 'utf8',
  legalComments: 'none',
})

const files = new Map()
for (const file of bundled.outputFiles) files.set(file.path.slice(DIST.length + 1), Buffer.from(file.contents))
for (const name of ['index.html', 'icon.svg']) files.set(name, readFileSync(join(HERE, 'src', name)))
files.set('LICENSES.txt', Buffer.from(licences(Object.keys(bundled.metafile.inputs))))

const compressed = [...files.values()].reduce((sum, content) => sum + gzipSync(content, { level: 9 }).length, 0)
if (compressed > MOST) fail(`the page has ${compressed} bytes compressed, and may have ${MOST}`)

if (process.argv.includes('--check')) {
  for (const [name, content] of files) {
    const path = join(DIST, name)
    if (!existsSync(path) || !readFileSync(path).equals(content))
      fail(`dist/${name} is not what src/ makes: cargo xtask page`)
  }
} else {
  mkdirSync(DIST, { recursive: true })
  for (const [name, content] of files) writeFileSync(join(DIST, name), content)
}
console.log(`${files.size} files, ${compressed} bytes compressed`)

/** The licences of the packages from which something is bundled. */
function licences(inputs) {
  const packages = new Set()
  for (const input of inputs) {
    const found = input.match(/^node_modules\/((?:@[^/]+\/)?[^/]+)\//)
    if (found) packages.add(found[1])
  }
  const texts = [...packages].sort().map((name) => {
    const folder = join(HERE, 'node_modules', name)
    const { version, license } = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'))
    const file = ['LICENSE', 'LICENSE.md', 'LICENSE.txt'].map((file) => join(folder, file)).find(existsSync)
    if (!file) fail(`${name} has no licence file`)
    return `${name} ${version} (${license})\n\n${readFileSync(file, 'utf8').trim()}\n`
  })
  return `The page is part of lexican, and is made with:\n\n${texts.join('\n' + '-'.repeat(80) + '\n\n')}`
}

function fail(why) {
  console.error(why)
  process.exit(1)
}
